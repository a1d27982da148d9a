#include "server/admin/collect.h"

#include <thread>

#include "absl/time/clock.h"
#include "tests/server/admin/admin_testing.h"
#include "tests/server/admin/s3_testing.h"
#include "tests/server/grpc/counting_catalog.h"

namespace liquidblend::admin {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::UnorderedElementsAre;

// A store whose collector has run before.
class CollectTest : public AdminTest {
 protected:
  CollectTest() { EXPECT_THAT(data_.blobs().WriteCatalogId(*data_.catalog().Id()), Succeeds()); }

  CollectReport MustCollect(const CollectOptions& options = {}) {
    const auto report = Collect(data_.catalog(), data_.blobs(), options);
    EXPECT_THAT(report, Succeeds());
    return report.ok() ? *report : CollectReport();
  }

  // As old as garbage is.
  store::BlobId PutOld(const std::string& text) {
    const store::BlobId id = data_.Put(text);
    Age(id, std::chrono::hours(25));
    return id;
  }
};

TEST_F(CollectTest, WhatAnUnfinishedJobNeedsStays) {
  const store::BlobId needed = data_.SubmitImport("drop");
  Age(needed, std::chrono::hours(25));
  PutOld("left over");
  const CollectReport report = MustCollect();
  EXPECT_EQ(report.num_deleted, 1);
  EXPECT_EQ(report.deleted_bytes, 9);
  EXPECT_EQ(report.num_unreferenced, 1);
  EXPECT_THAT(data_.Present(), ElementsAre(needed));
}

TEST_F(CollectTest, UploadedFilesGoWhenTheImportIsPublished) {
  const store::BlobId file = data_.SubmitImport("a");
  store::pb::AnimationRecord animation;
  animation.set_id("a");
  animation.set_blob(data_.Put("animation"));
  ASSERT_THAT(data_.catalog().PublishAnimation(data_.TakeJob().lease_id, animation), Succeeds());
  for (const store::BlobId& id : {file, animation.blob()}) Age(id, std::chrono::hours(25));
  EXPECT_EQ(MustCollect().num_deleted, 1);
  EXPECT_THAT(data_.Present(), ElementsAre(animation.blob()));
}

TEST_F(CollectTest, OldVersionsGoAndWhatWasDeletedToo) {
  const store::BlobId a = data_.MakeAnimation("a");
  const store::BlobId b = data_.MakeAnimation("b");
  data_.MakeFamily("f", 1);
  const store::BlobId second = data_.MakeFamily("f", 2);
  data_.MakeFamily("g", 3);
  ASSERT_THAT(data_.catalog().DeleteFamily("g"), Succeeds());
  for (const store::BlobId& id : data_.Present()) Age(id, std::chrono::hours(25));
  EXPECT_EQ(MustCollect().num_deleted, 4);  // and the two uploads
  EXPECT_THAT(data_.Present(), UnorderedElementsAre(a, b, second));
}

TEST_F(CollectTest, WhatIsYoungStays) {
  const store::BlobId upload = data_.Put("an upload that goes on");
  PutOld("left over");
  EXPECT_EQ(MustCollect().num_unreferenced, 2);
  EXPECT_THAT(data_.Present(), ElementsAre(upload));
  EXPECT_EQ(MustCollect({.older_than = absl::ZeroDuration()}).num_deleted, 1);
}

TEST_F(CollectTest, ADryRunDeletesNothing) {
  const store::BlobId id = PutOld("left over");
  EXPECT_EQ(MustCollect({.dry_run = true}).num_deleted, 1);
  EXPECT_THAT(data_.Present(), ElementsAre(id));
}

TEST_F(CollectTest, StopsWhenItIsAskedTo) {
  const store::BlobId id = PutOld("left over");
  EXPECT_EQ(MustCollect({.must_stop = [] { return true; }}).num_deleted, 0);
  EXPECT_THAT(data_.Present(), ElementsAre(id));
}

TEST_F(CollectTest, ForgetsJobsThatEndedLongAgo) {
  data_.MakeAnimation("a");
  data_.SubmitImport("b");
  EXPECT_EQ(MustCollect().num_pruned, 0);
  EXPECT_EQ(MustCollect({.keep_history = absl::ZeroDuration()}).num_pruned, 0);
  EXPECT_EQ(MustCollect({.keep_history = absl::Nanoseconds(1), .dry_run = true}).num_pruned, 1);
  EXPECT_EQ(MustCollect({.keep_history = absl::Nanoseconds(1)}).num_pruned, 1);
  EXPECT_EQ(data_.catalog().ListJobs(0, "")->records.size(), 1);
  EXPECT_THAT(data_.catalog().GetAnimation("a"), Succeeds());
}

TEST_F(CollectTest, RefusesAnAgeBelowZero) {
  EXPECT_THAT(Collect(data_.catalog(), data_.blobs(), {.older_than = -absl::Seconds(1)}),
              Fails(absl::StatusCode::kInvalidArgument, "older_than is out of range: -1s"));
  EXPECT_THAT(Collect(data_.catalog(), data_.blobs(), {.keep_history = -absl::Seconds(1)}),
              Fails(absl::StatusCode::kInvalidArgument, "keep_history is out of range: -1s"));
}

// Whoever publishes content that lay about as old garbage must find it there afterwards, whatever
// collectors on other handles do meanwhile.
TEST_F(CollectTest, NothingThatIsBeingPublishedGoes) {
  std::atomic<bool> is_done = false;
  std::vector<std::thread> collectors;
  for (int k = 0; k < 2; ++k) {
    collectors.emplace_back([&] {
      const TestedStore other(data_.location());
      while (!is_done) EXPECT_THAT(Collect(other.catalog(), other.blobs()), Succeeds());
    });
  }
  for (int round = 0; round < 40; ++round) {
    const std::string id = absl::StrCat("drop", round);
    for (const std::string text : {"frames of ", "animation "}) PutOld(text + id);
    const store::BlobId blob = data_.MakeAnimation(id);
    EXPECT_THAT(data_.blobs().Open(blob), Succeeds()) << "round " << round;
  }
  is_done = true;
  for (std::thread& collector : collectors) collector.join();
}

// A catalog that counts how often it lists its references.
class ListingCatalog final : public server::CountingCatalog {
 public:
  ListingCatalog(store::Catalog& catalog, absl::Duration pause)
      : CountingCatalog(catalog), pause_(pause) {}

  absl::StatusOr<std::vector<std::string>> ListReferencedBlobs() override {
    ++num_lists_;
    absl::SleepFor(pause_);
    return CountingCatalog::ListReferencedBlobs();
  }
  int num_lists() const { return num_lists_; }

 private:
  const absl::Duration pause_;
  int num_lists_ = 0;
};

// A catalog of millions of blobs takes seconds to list them. Four deletions take two seconds here.
TEST_F(CollectTest, ReferencesAreReadAgainAndIfThatTakesLongRarely) {
  CollectOptions options;
  options.must_stop = [] {
    absl::SleepFor(absl::Milliseconds(500));
    return false;
  };
  const auto num_lists = [&](absl::Duration pause) {
    for (int k = 0; k < 4; ++k) PutOld(absl::StrCat("left over ", k));
    ListingCatalog catalog(data_.catalog(), pause);
    const auto report = Collect(catalog, data_.blobs(), options);
    EXPECT_THAT(report, Succeeds());
    EXPECT_EQ(report->num_deleted, 4);
    return catalog.num_lists();
  };
  int num_quick_lists = 0;
  for (int k = 0; k < 5 && num_quick_lists < 2; ++k) {  // on a busy machine a list takes long, too
    num_quick_lists = num_lists(absl::ZeroDuration());
  }
  EXPECT_GE(num_quick_lists, 2);
  EXPECT_EQ(num_lists(absl::Milliseconds(1100)), 1);
}

// ---- catalogs of other blobs

class MarkTest : public AdminTest {
 protected:
  MarkTest() {
    for (const store::BlobId& id : data_.Present()) Age(id, std::chrono::hours(25));
  }

  const store::BlobId animation_ = data_.MakeAnimation("a");
  // A new and empty catalog, as of a mistyped or lost database.
  const std::unique_ptr<store::Catalog> other_ =
      *store::OpenSqliteCatalog(folder_.path() + "/other.sqlite");
};

TEST_F(MarkTest, ACatalogWithoutRecordsDeletesNoBlobsOfAnother) {
  ASSERT_THAT(Collect(data_.catalog(), data_.blobs()), Succeeds());
  EXPECT_EQ(*data_.blobs().ReadCatalogId(), *data_.catalog().Id());
  EXPECT_THAT(Collect(*other_, data_.blobs()),
              Fails(absl::StatusCode::kFailedPrecondition,
                    "the blobs belong to the catalog " + *data_.catalog().Id()));
  EXPECT_THAT(data_.Present(), ElementsAre(animation_));
}

TEST_F(MarkTest, WithoutAMarkBlobsThatTheCatalogDoesNotKnowStay) {
  const auto collected = Collect(*other_, data_.blobs());
  EXPECT_THAT(collected, Fails(absl::StatusCode::kFailedPrecondition, "refers to none"));
  EXPECT_EQ(*data_.blobs().ReadCatalogId(), "");
  EXPECT_EQ(data_.Present().size(), 2);  // with its upload
  EXPECT_THAT(Collect(data_.catalog(), data_.blobs()), Succeeds());
}

TEST_F(MarkTest, ANewStoreIsMarkedBeforeItHasBlobs) {
  store::TemporaryFolder folder;
  const auto blobs = *store::OpenLocalBlobStore(folder.path());
  ASSERT_THAT(Collect(*other_, *blobs, {.dry_run = true}), Succeeds());
  EXPECT_EQ(*blobs->ReadCatalogId(), "");
  ASSERT_THAT(Collect(*other_, *blobs), Succeeds());
  EXPECT_EQ(*blobs->ReadCatalogId(), *other_->Id());
}

TEST_F(MarkTest, AnUploadThatIsUnderWayInANewStoreIsNoFaultAndNoProof) {
  store::TemporaryFolder folder;
  const auto blobs = *store::OpenLocalBlobStore(folder.path());
  ASSERT_THAT(store::PutBlob(*blobs, AsBytes(std::string("under way"))), Succeeds());
  EXPECT_THAT(Collect(*other_, *blobs), Succeeds());
  EXPECT_EQ(*blobs->ReadCatalogId(), "");
}

TEST_F(MarkTest, TheOperatorMayGiveTheBlobsToAnotherCatalog) {
  ASSERT_THAT(Collect(data_.catalog(), data_.blobs()), Succeeds());
  const auto adopted = Collect(*other_, data_.blobs(), {.adopt = true});
  ASSERT_THAT(adopted, Succeeds());
  EXPECT_EQ(adopted->num_deleted, 1);
  EXPECT_THAT(data_.Present(), IsEmpty());
  EXPECT_THAT(Collect(data_.catalog(), data_.blobs()),
              Fails(absl::StatusCode::kFailedPrecondition, *other_->Id()));
}

// ---- listings that lag behind

class LaggingCollectTest : public testing::Test {
 protected:
  LaggingCollectTest() {
    EXPECT_THAT(store_.blobs->WriteCatalogId(*store_.catalog->Id()), Succeeds());
  }

  store::FakeS3 s3_;
  store::TemporaryFolder folder_;
  const store::Store store_ = OpenFakeS3Store(s3_, folder_.path());
};

TEST_F(LaggingCollectTest, AListingThatLagsIsAskedForAgain) {
  const store::BlobId garbage = *store::PutBlob(*store_.blobs, AsBytes(std::string("left over")));
  s3_.SetListLag(absl::Milliseconds(1500));
  CollectOptions options;
  options.older_than = absl::ZeroDuration();
  const auto report = Collect(*store_.catalog, *store_.blobs, options);
  ASSERT_THAT(report, Succeeds());
  EXPECT_EQ(report->num_deleted, 1);
  EXPECT_EQ(s3_.Objects().size(), 1);  // the mark
}

// A program that is killed while it sends parts leaves them, as does a client with urls.
TEST_F(LaggingCollectTest, UploadsInPartsThatWereLeftAreEnded) {
  s3_.SetListLag(absl::ZeroDuration());
  const std::string large(size_t{17} << 20, 'x');
  s3_.Plan("create upload", {store::FakeS3::Fault::kAnswerLost});
  ASSERT_THAT(store::PutBlob(*store_.blobs, AsBytes(large)), Succeeds());
  ASSERT_EQ(s3_.NumOpenUploads(), 1);
  CollectOptions options;
  options.older_than = absl::Hours(1);
  EXPECT_EQ(Collect(*store_.catalog, *store_.blobs, options)->num_uploads, 0);
  s3_.SetClockAhead(absl::Hours(2));
  options.dry_run = true;
  EXPECT_EQ(Collect(*store_.catalog, *store_.blobs, options)->num_uploads, 0);
  EXPECT_EQ(s3_.NumOpenUploads(), 1);
  options.dry_run = false;
  // Without the right to list them the rest is collected all the same.
  s3_.Plan("list uploads", {store::FakeS3::Fault::kStatus403});
  EXPECT_THAT(Collect(*store_.catalog, *store_.blobs, options), Succeeds());
  EXPECT_EQ(s3_.NumOpenUploads(), 1);
  EXPECT_EQ(Collect(*store_.catalog, *store_.blobs, options)->num_uploads, 1);
  EXPECT_EQ(s3_.NumOpenUploads(), 0);
}

TEST_F(LaggingCollectTest, NothingIsCollectedByAListingThatKeepsLagging) {
  ASSERT_THAT(store::PutBlob(*store_.blobs, AsBytes(std::string("left over"))), Succeeds());
  s3_.SetListLag(absl::Hours(1));
  CollectOptions options;
  options.older_than = absl::ZeroDuration();
  EXPECT_THAT(Collect(*store_.catalog, *store_.blobs, options),
              Fails(absl::StatusCode::kUnavailable, "not in the list"));
  EXPECT_EQ(s3_.Objects().size(), 2);  // and the mark; the probe is gone
}

}  // namespace
}  // namespace liquidblend::admin
