#include "server/admin/check.h"

#include <filesystem>
#include <utility>

#include "core/base/retry.h"
#include "core/store/blobs/http_client.h"
#include "core/store/blobs/mapped_file.h"
#include "core/store/sql/sqlite.h"
#include "server/catalog/families.h"
#include "tests/core/store/blobs/hooked_blobs.h"
#include "tests/server/admin/admin_testing.h"
#include "tests/server/admin/s3_testing.h"

namespace liquidblend::admin {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

class CheckTest : public AdminTest {
 protected:
  CheckReport MustCheck(const CheckOptions& options = {}) {
    const parallel::Arena arena(2);
    Progress progress(Progress::Style::kNone);
    const auto report = Check(data_.location(), arena, progress, options);
    EXPECT_THAT(report, Succeeds());
    return report.ok() ? *report : CheckReport();
  }

  store::pb::AnimationRecord::State StateOf(const std::string& animation) {
    return data_.catalog().GetAnimation(animation)->state();
  }

  std::unique_ptr<store::Database> OpenRaw() {
    return *store::Database::Open(store::CatalogPath(data_.location().data), absl::Seconds(10));
  }
};

TEST_F(CheckTest, FindsNothingInAWholeStore) {
  data_.MakeAnimation("a");
  data_.MakeAnimation("b");
  data_.MakeFamily("f", 1);
  data_.SubmitImport("c");
  const CheckReport report = MustCheck();
  EXPECT_THAT(report.damage, IsEmpty());
  EXPECT_EQ(report.num_animations, 3);
  EXPECT_EQ(report.num_families, 1);
  EXPECT_EQ(report.num_jobs, 4);
  EXPECT_EQ(report.num_blobs, 6);
  EXPECT_EQ(report.num_unreferenced, 2);  // the uploaded files of a and b
  EXPECT_EQ(report.unreferenced_bytes, 2 * 11);
}

TEST_F(CheckTest, NamesWhatIsMissingAndWhoNeedsIt) {
  const store::BlobId a = data_.MakeAnimation("a");
  data_.MakeAnimation("b");
  const store::BlobId family = data_.MakeFamily("f", 1);
  const store::BlobId file = data_.SubmitImport("c");
  for (const store::BlobId& id : {a, family, file}) {
    ASSERT_THAT(data_.blobs().Delete(id), Succeeds());
  }
  std::map<store::BlobId, std::vector<std::string>> missing;
  for (const admin::Damage& damage : MustCheck().damage) {
    EXPECT_TRUE(absl::IsNotFound(damage.error)) << damage.error;
    EXPECT_THAT(std::string(damage.error.message()), HasSubstr(damage.blob));
    missing[damage.blob] = damage.needed_by;
  }
  EXPECT_EQ(missing.size(), 3);
  EXPECT_THAT(missing[a], ElementsAre("animations/a"));
  EXPECT_THAT(missing[family], ElementsAre("families/f"));
  EXPECT_THAT(missing[file], ElementsAre(StartsWith("jobs/import-")));
}

TEST_F(CheckTest, NamesDamagedBlobsNeededOrNot) {
  const store::BlobId a = data_.MakeAnimation("a");
  const store::BlobId garbage = data_.Put("left over");
  Damage(a);
  Damage(garbage);
  const CheckReport report = MustCheck();
  ASSERT_EQ(report.damage.size(), 2);
  for (const admin::Damage& damage : report.damage) {
    EXPECT_TRUE(absl::IsDataLoss(damage.error)) << damage.error;
    EXPECT_THAT(std::string(damage.error.message()), HasSubstr(PathOf(damage.blob)));
    EXPECT_EQ(damage.needed_by.empty(), damage.blob == garbage);
    EXPECT_EQ(damage.repair, "");
  }
}

TEST_F(CheckTest, OpensTheFilesOfFamilies) {
  data_.MakeAnimation("a");
  data_.MakeAnimation("b");
  data_.SubmitRegistration("f", "a", {"b"});
  store::pb::FamilyRecord family;
  family.set_id("f");
  family.set_blob(data_.Put("whole, but no family file"));
  ASSERT_THAT(data_.catalog().PublishFamily(data_.TakeJob().lease_id, family), Succeeds());
  for (const bool repair : {true, false}) {  // moving it away would help nobody
    const CheckReport report = MustCheck({.repair = repair});
    ASSERT_EQ(report.damage.size(), 1);
    EXPECT_THAT(report.damage[0].error,
                Fails(absl::StatusCode::kInvalidArgument, "is not a file of this type"));
    EXPECT_THAT(report.damage[0].needed_by, ElementsAre("families/f"));
  }
}

TEST_F(CheckTest, NamesRecordsThatCannotBeReadOrContradictOthers) {
  data_.MakeAnimation("a");
  data_.MakeAnimation("b");
  data_.MakeFamily("f", 1);
  ASSERT_THAT(OpenRaw()->RunScript("UPDATE animations SET record = X'FFFF' WHERE id = 'a';"
                                   "UPDATE families SET version = 2;"
                                   "DELETE FROM animations WHERE id = 'b';"),
              Succeeds());
  std::vector<std::string> faults;
  for (const admin::Damage& damage : MustCheck().damage) {
    faults.emplace_back(damage.error.message());
  }
  EXPECT_THAT(faults, ElementsAre("the record of animation 'a' cannot be read",
                                  "the record of family 'f' contradicts the columns of its row",
                                  HasSubstr("family 'f' has animation 'b', but not both")));
}

TEST_F(CheckTest, TellsOfADamagedDatabase) {
  for (int k = 0; k < 30; ++k) data_.SubmitImport(absl::StrCat("drop", k));
  ASSERT_THAT(OpenRaw()->RunScript("PRAGMA wal_checkpoint(TRUNCATE)"), Succeeds());
  const std::string path = store::CatalogPath(data_.location().data);
  const std::string whole = store::ReadFile(path);
  int num_noticed = 0;
  for (size_t page = 1; page < whole.size() / 4096; ++page) {
    const store::TemporaryFolder folder;
    std::string damaged = whole;
    damaged.replace(page * 4096, 64, std::string(64, '\x7f'));
    store::WriteFile(store::CatalogPath(folder.path()), damaged);
    const parallel::Arena arena(1);
    Progress progress(Progress::Style::kNone);
    const auto report = Check(LocationIn(folder.path()), arena, progress);
    ASSERT_THAT(report, Succeeds());
    num_noticed += report->damage.empty() ? 0 : 1;
  }
  // What lies in pages that are free is nobody's.
  EXPECT_GT(num_noticed, static_cast<int>(whole.size() / 4096) / 2);
}

// ---- repair

TEST_F(CheckTest, RepairMovesDamageAsideAndLosesNothing) {
  const store::BlobId a = data_.MakeAnimation("a");
  data_.MakeAnimation("b");
  const store::BlobId garbage = data_.Put("left over");
  Damage(a);
  Damage(garbage);
  const std::string damaged = store::ReadFile(PathOf(a));
  const CheckReport report = MustCheck({.repair = true});
  ASSERT_EQ(report.damage.size(), 2);
  const admin::Damage& of_a = report.damage[report.damage[0].blob == a ? 0 : 1];
  EXPECT_THAT(of_a.repair, HasSubstr("animations/a is FAILED"));
  const std::string aside = of_a.repair.substr(std::string("moved to ").size());
  EXPECT_EQ(store::ReadFile(aside.substr(0, aside.find(';'))), damaged);
  EXPECT_EQ(StateOf("a"), store::pb::AnimationRecord::FAILED);
  EXPECT_EQ(StateOf("b"), store::pb::AnimationRecord::READY);
  EXPECT_THAT(data_.catalog().GetAnimation("a")->error().message(), HasSubstr("is damaged"));

  // It stays known until it is there again: put back, or imported anew.
  const CheckReport second = MustCheck({.repair = true});
  ASSERT_EQ(second.damage.size(), 1);
  EXPECT_THAT(second.damage[0].needed_by, ElementsAre("animations/a"));
  EXPECT_EQ(data_.Put("animation a"), a);
  const CheckReport third = MustCheck({.repair = true});
  EXPECT_THAT(third.damage, IsEmpty());
  EXPECT_THAT(third.repaired, ElementsAre("animations/a"));
  EXPECT_EQ(StateOf("a"), store::pb::AnimationRecord::READY);
  EXPECT_FALSE(data_.catalog().GetAnimation("a")->has_error());
}

TEST_F(CheckTest, WithoutRepairNothingChanges) {
  const store::BlobId a = data_.MakeAnimation("a");
  Damage(a);
  const std::string damaged = store::ReadFile(PathOf(a));
  MustCheck();
  EXPECT_EQ(store::ReadFile(PathOf(a)), damaged);
  EXPECT_EQ(StateOf("a"), store::pb::AnimationRecord::READY);
}

// ---- any byte

TEST_F(CheckTest, AnyChangedByteOfAFamilyIsFoundOnLoadAndByTheCheckAndTheOthersAreServed) {
  data_.MakeAnimation("a");
  data_.MakeAnimation("b");
  const store::BlobId broken = data_.MakeFamily("broken", 1);
  data_.MakeFamily("whole", 2);
  const std::string content = store::ReadFile(PathOf(broken));
  ASSERT_GT(content.size(), 1000);
  for (size_t k = 0; k < content.size(); ++k) {  // header, manifest, sections, padding
    std::string damaged = content;
    damaged[k] = static_cast<char>(damaged[k] ^ 0x10);
    store::WriteFile(PathOf(broken), damaged);
    liquidblend::catalog::Families families(data_.catalog(), data_.blobs());
    EXPECT_THAT(families.Get("broken"), Fails(absl::StatusCode::kDataLoss, "family broken: "))
        << "byte " << k;
    EXPECT_THAT(families.Get("broken"), Fails(absl::StatusCode::kDataLoss, PathOf(broken)));
    EXPECT_THAT(families.Get("whole"), Succeeds()) << "byte " << k;
    if (k % 16 != 0) continue;  // it takes longer
    const CheckReport report = MustCheck();
    ASSERT_EQ(report.damage.size(), 1) << "byte " << k;
    EXPECT_EQ(report.damage[0].blob, broken);
    EXPECT_THAT(report.damage[0].needed_by, ElementsAre("families/broken"));
  }
  store::WriteFile(PathOf(broken), content);
  EXPECT_THAT(MustCheck().damage, IsEmpty());
}

// ---- an S3 that is not what it should be

class CheckS3Test : public testing::Test {
 protected:
  CheckS3Test() {
    store::pb::AnimationRecord animation;
    animation.set_id("a");
    store::pb::JobRecord job;
    job.mutable_import_animation()->set_animation("a");
    EXPECT_THAT(store_.catalog->SubmitImport(animation, job), Succeeds());
    const auto lease = store_.catalog->LeaseJob("host:1", absl::Minutes(1));
    animation.set_blob(*store::PutBlob(*store_.blobs, AsBytes(std::string("animation"))));
    EXPECT_THAT(store_.catalog->PublishAnimation((*lease)->lease_id, animation), Succeeds());
  }
  absl::StatusOr<CheckReport> Check(const CheckOptions& options = {}) {
    const parallel::Arena arena(2);
    Progress progress(Progress::Style::kNone);
    return CheckStore(store_, arena, progress, options);
  }

  store::FakeS3 s3_;
  store::TemporaryFolder folder_;
  store::Store store_ = OpenFakeS3Store(s3_, folder_.path());
};

TEST_F(CheckS3Test, ABlobThatIsNotListedYetIsNotMissing) {
  s3_.SetListLag(absl::Hours(1));
  const auto report = Check();
  ASSERT_THAT(report, Succeeds());
  EXPECT_THAT(report->damage, IsEmpty());
}

TEST_F(CheckS3Test, ABlobThatIsGoneIsMissing) {
  const store::BlobId blob = store_.catalog->GetAnimation("a")->blob();
  ASSERT_THAT(store_.blobs->Delete(blob), Succeeds());
  const auto report = Check();
  ASSERT_THAT(report, Succeeds());
  ASSERT_EQ(report->damage.size(), 1);
  EXPECT_TRUE(absl::IsNotFound(report->damage.front().error));
}

// An animation must not be given up because S3 refuses or is away.
TEST_F(CheckS3Test, BlobsThatCannotBeReadNowAreNotDamaged) {
  for (const store::FakeS3::Fault fault :
       {store::FakeS3::Fault::kStatus403, store::FakeS3::Fault::kStatus500}) {
    s3_.Plan("HEAD", std::vector<store::FakeS3::Fault>(100, fault));
    const absl::Status status = Check({.repair = true}).status();
    EXPECT_TRUE(base::IsTransient(status)) << status;
    EXPECT_EQ(store_.catalog->GetAnimation("a")->state(), store::pb::AnimationRecord::READY);
    s3_.Plan("HEAD", {});
  }
  EXPECT_THAT(Check()->damage, IsEmpty());
}

// The cache's disk fails after its copy was opened: the check goes on, and says so.
TEST_F(CheckS3Test, ACopyThatCannotBeReadIsNotPutAgain) {
  store::SurviveUnreadablePages();
  const store::BlobId blob = store_.catalog->GetAnimation("a")->blob();
  const std::string damaged = "Animation";
  store::HttpRequest request;
  request.method = "PUT";
  request.url = absl::StrCat(s3_.endpoint(), "/bucket/store/", store::BlobKey(blob));
  request.body = AsBytes(damaged);
  ASSERT_THAT(store::HttpClient({}).Run({&request, 1}).front(), Succeeds());
  auto hooked = std::make_unique<store::HookedBlobs>(std::move(store_.blobs));
  hooked->after_open = [&](const store::BlobId& id) {
    std::filesystem::resize_file(store::LocalBlobPath(folder_.path() + "/cache", id), 0);
  };
  store_.blobs = std::move(hooked);
  const auto report = Check({.repair = true});
  ASSERT_THAT(report, Succeeds());
  ASSERT_EQ(report->damage.size(), 1);
  EXPECT_THAT(report->damage[0].repair, StartsWith("moved to s3://bucket/store/quarantine/"));
  EXPECT_THAT(report->damage[0].repair, HasSubstr("not put again from the cache: a part of "));
  EXPECT_EQ(store_.catalog->GetAnimation("a")->state(), store::pb::AnimationRecord::FAILED);
}

}  // namespace
}  // namespace liquidblend::admin
