#include "server/sweep_blobs.h"

#include <memory>
#include <string>
#include <vector>

#include "absl/time/clock.h"
#include "core/store/catalog.h"
#include "core/store/data_directory.h"
#include "tests/core/store/store_testing.h"

namespace liquidblend::server {
namespace {

class SweepBlobsTest : public testing::Test {
 protected:
  SweepBlobsTest()
      : catalog_(*store::OpenSqliteCatalog(store::CatalogPath(folder_.path()))),
        blobs_(*store::OpenLocalBlobStore(folder_.path())) {}

  store::BlobId Put(const std::string& text) {
    return *store::PutBlob(*blobs_, store::AsBytes(text));
  }

  // An import that is queued, of one file.
  void SubmitImport(const store::BlobId& file) {
    store::pb::AnimationRecord animation;
    animation.set_id("drop");
    store::pb::JobRecord job;
    job.mutable_import_animation()->set_animation("drop");
    job.mutable_import_animation()->add_files()->set_blob(file);
    ASSERT_TRUE(catalog_->SubmitImport(animation, job).ok());
  }

  std::vector<store::BlobId> Present() {
    const std::vector<store::BlobInfo> blobs = *blobs_->List();
    std::vector<store::BlobId> ids;
    for (const store::BlobInfo& blob : blobs) ids.push_back(blob.id);
    return ids;
  }

  store::TemporaryFolder folder_;
  std::unique_ptr<store::Catalog> catalog_;
  std::unique_ptr<store::BlobStore> blobs_;
  const absl::Time tomorrow_ = absl::Now() + absl::Hours(25);
};

TEST_F(SweepBlobsTest, WhatAnUnfinishedJobNeedsStays) {
  const store::BlobId needed = Put("needed");
  Put("left over");
  SubmitImport(needed);
  const auto report = SweepBlobs(*catalog_, *blobs_, tomorrow_, absl::Hours(24));
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_EQ(report->num_deleted, 1);
  EXPECT_EQ(report->num_bytes, 9);
  EXPECT_THAT(Present(), testing::ElementsAre(needed));
}

TEST_F(SweepBlobsTest, UploadedFilesGoWhenTheImportIsPublished) {
  SubmitImport(Put("uploaded"));
  const auto lease = catalog_->LeaseJob("test", absl::Hours(1));
  store::pb::AnimationRecord animation;
  animation.set_id("drop");
  animation.set_blob(Put("animation"));
  ASSERT_TRUE(catalog_->PublishAnimation((*lease)->lease_id, animation).ok());
  ASSERT_TRUE(SweepBlobs(*catalog_, *blobs_, tomorrow_, absl::Hours(24)).ok());
  EXPECT_THAT(Present(), testing::ElementsAre(animation.blob()));
}

TEST_F(SweepBlobsTest, WhatIsYoungStays) {
  Put("an upload that goes on");
  const auto report = SweepBlobs(*catalog_, *blobs_, absl::Now(), absl::Hours(24));
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_EQ(report->num_deleted, 0);
  EXPECT_EQ(Present().size(), 1U);
}

}  // namespace
}  // namespace liquidblend::server
