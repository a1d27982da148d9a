#include "server/admin/transfer.h"

#include <atomic>
#include <fstream>
#include <memory>
#include <sstream>
#include <utility>
#include <vector>

#include "absl/time/clock.h"
#include "server/admin/check.h"
#include "tests/core/store/blobs/hooked_blobs.h"
#include "tests/server/admin/admin_testing.h"
#include "tests/server/admin/s3_testing.h"

namespace liquidblend::admin {
namespace {

class TransferTest : public AdminTest {
 protected:
  TransferTest() {
    data_.MakeAnimation("a");
    data_.MakeAnimation("b");
    family_ = data_.MakeFamily("f", 1);
  }

  absl::StatusOr<TransferReport> Export() {
    return ExportToDirectory(data_.store(), export_, arena_, progress_);
  }

  absl::StatusOr<TransferReport> Import(const TestedStore& to) {
    return ImportFromDirectory(export_, to.store(), arena_, progress_);
  }

  TestedStore NewStore() {
    return TestedStore(LocationIn(absl::StrCat(folder_.path(), "/store", num_stores_++)));
  }

  bool IsWhole(const TestedStore& tested) {
    return Check(tested.location(), arena_, progress_)->damage.empty();
  }

  std::string CatalogFile() const { return absl::StrCat(export_, "/catalog"); }

  static int NumAnimations(const TestedStore& tested) {
    return static_cast<int>(tested.catalog().ListAnimations(0, "")->records.size());
  }

  static std::string FileOf(const std::string& directory, const store::BlobId& id) {
    return store::LocalBlobPath(directory, id);
  }

  const std::string export_ = absl::StrCat(folder_.path(), "/export");
  const parallel::Arena arena_{2};
  Progress progress_{Progress::Style::kNone};
  store::BlobId family_;
  int num_stores_ = 0;
};

TEST_F(TransferTest, EverythingArrivesByADirectory) {
  data_.Put("what nobody needs stays behind");
  const auto exported = Export();
  ASSERT_THAT(exported, Succeeds());
  EXPECT_EQ(exported->num_copied, 3);
  const TestedStore other = NewStore();
  const auto imported = Import(other);
  ASSERT_THAT(imported, Succeeds());
  EXPECT_EQ(imported->num_animations, 2);
  EXPECT_EQ(imported->num_families, 1);
  EXPECT_EQ(imported->num_jobs, 3);
  EXPECT_EQ(imported->num_copied, 3);
  EXPECT_EQ(imported->copied_bytes, exported->copied_bytes);
  EXPECT_EQ(other.catalog().GetFamily("f")->SerializeAsString(),
            data_.catalog().GetFamily("f")->SerializeAsString());
  EXPECT_TRUE(IsWhole(other));
}

TEST_F(TransferTest, EverythingArrivesByAStream) {
  std::stringstream stream;
  const auto exported = ExportToStream(data_.store(), stream, progress_);
  ASSERT_THAT(exported, Succeeds());
  const TestedStore other = NewStore();
  const auto imported = ImportFromStream(stream, other.store(), progress_);
  ASSERT_THAT(imported, Succeeds());
  EXPECT_EQ(imported->copied_bytes, exported->copied_bytes);
  EXPECT_TRUE(IsWhole(other));
  EXPECT_THAT(other.blobs().Open(family_), Succeeds());
}

TEST_F(TransferTest, WorkThatWasUnderWayIsQueuedAgain) {
  data_.SubmitImport("c");
  data_.SubmitRegistration("g", "a", {"a", "b"});
  const store::Lease import = data_.TakeJob();
  const store::Lease child = data_.TakeJob();
  ASSERT_THAT(data_.catalog().FinishChild(child.lease_id, data_.Put("target file")), Succeeds());
  ASSERT_THAT(Export(), Succeeds());
  const TestedStore other = NewStore();
  ASSERT_THAT(Import(other), Succeeds());
  const store::Lease again = other.TakeJob();
  EXPECT_EQ(again.job.id(), import.job.id());
  EXPECT_EQ(again.job.attempts(), 1);
  EXPECT_EQ(other.TakeJob().job.register_target().target_index(), 1);
  EXPECT_TRUE(IsWhole(other));
  // Here it goes on, too.
  EXPECT_THAT(data_.catalog().Heartbeat(import.lease_id, absl::Minutes(1), {}), Succeeds());
}

TEST_F(TransferTest, GoesOnWhereItBrokeOff) {
  std::filesystem::create_directories(absl::StrCat(folder_.path(), "/elsewhere"));
  std::filesystem::rename(PathOf(family_), absl::StrCat(folder_.path(), "/elsewhere/family"));
  EXPECT_THAT(Export(), Fails(absl::StatusCode::kDataLoss, family_));
  EXPECT_FALSE(std::filesystem::exists(CatalogFile()));
  std::filesystem::rename(absl::StrCat(folder_.path(), "/elsewhere/family"), PathOf(family_));
  const auto exported = Export();
  ASSERT_THAT(exported, Succeeds());
  EXPECT_EQ(exported->num_copied + exported->num_skipped, 3);
  EXPECT_GE(exported->num_copied, 1);

  std::filesystem::rename(FileOf(export_, family_),
                          absl::StrCat(folder_.path(), "/elsewhere/family"));
  const TestedStore other = NewStore();
  EXPECT_THAT(Import(other), Fails(absl::StatusCode::kDataLoss, "the export is not complete"));
  EXPECT_EQ(NumAnimations(other), 0);
  std::filesystem::rename(absl::StrCat(folder_.path(), "/elsewhere/family"),
                          FileOf(export_, family_));
  const auto imported = Import(other);
  ASSERT_THAT(imported, Succeeds());
  EXPECT_EQ(imported->num_copied + imported->num_skipped, 3);
  EXPECT_TRUE(IsWhole(other));
}

TEST_F(TransferTest, WritesBlobsAfreshThatLayThereForLongAsNobodyNeededThem) {
  ASSERT_THAT(Export(), Succeeds());
  const TestedStore other = NewStore();
  for (const char* text : {"animation a", "animation b"}) other.Put(text);
  const std::string old = FileOf(other.location().data, data_.Put("animation a"));
  std::filesystem::last_write_time(
      old, std::filesystem::file_time_type::clock::now() - std::chrono::hours(23));
  const auto imported = Import(other);
  ASSERT_THAT(imported, Succeeds());
  EXPECT_EQ(imported->num_skipped, 1);
  EXPECT_EQ(imported->num_copied, 2);
  EXPECT_GT(std::filesystem::last_write_time(old),
            std::filesystem::file_time_type::clock::now() - std::chrono::hours(1));
}

// A store in S3 has a clock of its own, and so has the machine that imports.
class TransferToS3Test : public TransferTest {
 protected:
  TransferToS3Test() { EXPECT_THAT(ExportToStream(data_.store(), stream_, progress_), Succeeds()); }

  store::FakeS3 s3_;
  std::stringstream stream_;
};

// A store whose lists show nothing any more once it gets the first blob of an import.
class LaggingBlobs : public store::HookedBlobs {
 public:
  using HookedBlobs::HookedBlobs;
  absl::StatusOr<std::unique_ptr<store::BlobWriter>> CreateAs(const store::BlobId& id) override {
    is_lagging_ = true;
    return HookedBlobs::CreateAs(id);
  }
  absl::StatusOr<std::vector<store::BlobInfo>> List() override {
    if (is_lagging_) return std::vector<store::BlobInfo>();
    return HookedBlobs::List();
  }

 private:
  std::atomic<bool> is_lagging_ = false;
};

TEST_F(TransferToS3Test, AllBlobsArriveThoughTheClockOfTheStoreIsFarBehind) {
  s3_.SetClockAhead(-absl::Hours(13));
  const store::Store other = OpenFakeS3Store(s3_, folder_.path());
  const auto imported = ImportFromStream(stream_, other, progress_);
  ASSERT_THAT(imported, Succeeds());
  EXPECT_EQ(imported->num_copied, 3);
  ASSERT_THAT(Export(), Succeeds());
  const std::string folder = absl::StrCat(folder_.path(), "/second");
  const store::Store second = OpenFakeS3Store(s3_, folder);  // the same blobs
  const auto again = ImportFromDirectory(export_, second, arena_, progress_);
  ASSERT_THAT(again, Succeeds());
  EXPECT_EQ(again->num_skipped, 3);
}

TEST_F(TransferToS3Test, WhatIsOldByTheClockOfTheStoreIsWrittenAfresh) {
  const store::Store other = OpenFakeS3Store(s3_, folder_.path());
  ASSERT_THAT(store::PutBlob(*other.blobs, AsBytes("animation a")), Succeeds());
  s3_.SetClockAhead(absl::Hours(23));
  const auto imported = ImportFromStream(stream_, other, progress_);
  ASSERT_THAT(imported, Succeeds());
  EXPECT_EQ(imported->num_skipped, 0);
  const auto present = other.blobs->List();
  ASSERT_THAT(present, Succeeds());
  EXPECT_EQ(present->size(), 3);
  for (const store::BlobInfo& info : *present) {
    EXPECT_GT(info.modified, absl::Now() + absl::Hours(22)) << info.id;
  }
}

// Its lists show nothing of what is there, neither at the begin nor at the end.
TEST_F(TransferToS3Test, AllBlobsAreCopiedToAStoreWhoseListsLag) {
  s3_.SetListLag(absl::Hours(1));
  const store::Store other = OpenFakeS3Store(s3_, folder_.path());
  const auto imported = ImportFromStream(stream_, other, progress_);
  ASSERT_THAT(imported, Succeeds());
  EXPECT_EQ(imported->num_copied, 3);
  ASSERT_THAT(Export(), Succeeds());
  const store::Store second = OpenFakeS3Store(s3_, absl::StrCat(folder_.path(), "/second"));
  const auto again = ImportFromDirectory(export_, second, arena_, progress_);
  ASSERT_THAT(again, Succeeds());
  EXPECT_EQ(again->num_copied, 3);
  EXPECT_EQ(again->num_skipped, 0);
  EXPECT_EQ(second.catalog->ListAnimations(0, "")->records.size(), 2);
}

// What was skipped by an earlier list is not missing.
TEST_F(TransferToS3Test, ListsMayBeginToLag) {
  store::Store other = OpenFakeS3Store(s3_, folder_.path());
  ASSERT_THAT(store::PutBlob(*other.blobs, AsBytes("animation a")), Succeeds());
  other.blobs = std::make_unique<LaggingBlobs>(std::move(other.blobs));
  const auto imported = ImportFromStream(stream_, other, progress_);
  ASSERT_THAT(imported, Succeeds());
  EXPECT_EQ(imported->num_skipped, 1);
  EXPECT_EQ(imported->num_copied, 2);
}

TEST_F(TransferToS3Test, AStoreThatIsAwayIsNoStoreWhoseListsLag) {
  const store::Store other = OpenFakeS3Store(s3_, folder_.path());
  s3_.Plan("list", std::vector(20, store::FakeS3::Fault::kStatus503));
  EXPECT_THAT(ImportFromStream(stream_, other, progress_),
              Fails(absl::StatusCode::kUnavailable, ""));
  EXPECT_EQ(other.catalog->ListAnimations(0, "")->records.size(), 0);
}

TEST_F(TransferTest, IsRefusedAsAWholeIfANameIsTaken) {
  ASSERT_THAT(Export(), Succeeds());
  const TestedStore other = NewStore();
  other.MakeAnimation("b");
  EXPECT_THAT(Import(other), Fails(absl::StatusCode::kAlreadyExists, "animation 'b'"));
  EXPECT_EQ(NumAnimations(other), 1);
  EXPECT_THAT(Import(data_), Fails(absl::StatusCode::kAlreadyExists, "animation 'a'"));
}

TEST_F(TransferTest, AddsToAStoreThatHasOtherNames) {
  ASSERT_THAT(Export(), Succeeds());
  const TestedStore other = NewStore();
  other.MakeAnimation("c");
  ASSERT_THAT(Import(other), Succeeds());
  EXPECT_EQ(NumAnimations(other), 3);
  EXPECT_TRUE(IsWhole(other));
}

TEST_F(TransferTest, NamesWhatIsDamagedOnEitherSide) {
  ASSERT_THAT(Export(), Succeeds());
  const std::string path = FileOf(export_, family_);
  std::string content = store::ReadFile(path);
  content[100] ^= 1;
  store::WriteFile(path, content);
  const TestedStore other = NewStore();
  EXPECT_THAT(Import(other), Fails(absl::StatusCode::kDataLoss, family_));
  EXPECT_EQ(NumAnimations(other), 0);
  ASSERT_THAT(Export(), Succeeds());  // which repairs the export
  store::WriteFile(CatalogFile(), store::ReadFile(CatalogFile()).substr(0, 300));
  EXPECT_THAT(Import(other), Fails(absl::StatusCode::kDataLoss, CatalogFile()));
  Damage(family_);
  std::filesystem::remove_all(export_);
  EXPECT_THAT(Export(), Fails(absl::StatusCode::kDataLoss, family_));
}

TEST_F(TransferTest, NoticesAStreamThatBreaksOffOrIsDamaged) {
  std::stringstream stream;
  ASSERT_THAT(ExportToStream(data_.store(), stream, progress_), Succeeds());
  const std::string whole = stream.str();
  const TestedStore other = NewStore();
  for (const size_t size : {size_t{600}, whole.size() / 2, whole.size() - 1100}) {
    std::istringstream in(whole.substr(0, size));
    EXPECT_THAT(ImportFromStream(in, other.store(), progress_),
                Fails(absl::StatusCode::kDataLoss, "Truncated"));
  }
  std::string damaged = whole;
  damaged[520] ^= 1;  // the first blob
  const TestedStore another = NewStore();
  std::istringstream in(damaged);
  EXPECT_THAT(ImportFromStream(in, another.store(), progress_),
              Fails(absl::StatusCode::kDataLoss, "of the archive is damaged"));
  EXPECT_EQ(NumAnimations(other), 0);
  EXPECT_EQ(NumAnimations(another), 0);
}

TEST_F(TransferTest, DoesNotExportIntoADataDirectory) {
  EXPECT_THAT(ExportToDirectory(data_.store(), data_.location().data, arena_, progress_),
              Fails(absl::StatusCode::kFailedPrecondition, "is a data directory"));
}

TEST_F(TransferTest, AnAnimationWhoseFileIsLostGoesWithoutIt) {
  const store::BlobId blob = data_.catalog().GetAnimation("a")->blob();
  ASSERT_THAT(data_.blobs().Delete(blob), Succeeds());
  ASSERT_THAT(Check(data_.location(), arena_, progress_, {.repair = true}), Succeeds());
  ASSERT_THAT(Export(), Succeeds());
  const TestedStore other = NewStore();
  ASSERT_THAT(Import(other), Succeeds());
  EXPECT_EQ(other.catalog().GetAnimation("a")->state(), store::pb::AnimationRecord::FAILED);
}

}  // namespace
}  // namespace liquidblend::admin
