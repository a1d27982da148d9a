// A store in a temporary folder, with animations and small families in it, and what methods need.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "core/store/blob_store.h"
#include "core/store/catalog.h"
#include "core/store/data_directory.h"
#include "core/store/files.h"
#include "google/rpc/error_details.pb.h"
#include "server/rpc/backends.h"
#include "server/rpc/errors.h"
#include "tests/core/store/store_testing.h"
#include "tests/synthetic/families.h"

namespace liquidblend::rpc {

inline constexpr int kFamilyFrames = 8;

// The fields that a status blames.
inline std::vector<std::string> BlamedFields(const absl::Status& status) {
  std::vector<std::string> fields;
  google::rpc::BadRequest details;
  const absl::optional<absl::Cord> payload = status.GetPayload(kBadRequestUrl);
  if (!payload.has_value() || !details.ParseFromString(std::string(*payload))) return fields;
  for (const auto& violation : details.field_violations()) fields.push_back(violation.field());
  return fields;
}

class RpcTest : public testing::Test {
 protected:
  RpcTest()
      : catalog_(*store::OpenSqliteCatalog(store::CatalogPath(folder_.path()))),
        blobs_(*store::OpenLocalBlobStore(folder_.path())),
        families_(*catalog_, *blobs_) {}

  static Limits SmallLimits() {
    Limits limits;
    limits.max_upload_files = 4;
    limits.max_upload_bytes = 1000;
    limits.max_chunk_bytes = 100;
    limits.max_targets = 3;
    limits.max_correspondences = 2;
    limits.watch_interval = absl::Milliseconds(5);
    return limits;
  }

  store::Lease TakeJob() {
    auto lease = catalog_->LeaseJob("test", absl::Hours(1));
    EXPECT_TRUE(lease.ok() && lease->has_value()) << lease.status();
    return **lease;
  }

  store::pb::JobRecord SubmitImport(const std::string& id) {
    store::pb::AnimationRecord animation;
    animation.set_id(id);
    store::pb::JobRecord job;
    job.mutable_import_animation()->set_animation(id);
    const auto submitted = catalog_->SubmitImport(animation, job);
    EXPECT_TRUE(submitted.ok()) << submitted.status();
    return *submitted;
  }

  void ImportAnimation(const std::string& id) {
    SubmitImport(id);
    store::pb::AnimationRecord animation;
    animation.set_id(id);
    animation.mutable_manifest()->set_num_frames(kFamilyFrames);
    animation.mutable_manifest()->set_frames_per_second(24);
    EXPECT_TRUE(catalog_->PublishAnimation(TakeJob().lease_id, animation).ok());
  }

  // A growing sphere and one target that moves every vertex by up to 0.1 m. The animations that it
  // is made of must be there.
  void PublishFamily(const std::string& id, const std::string& source, const std::string& target,
                     uint64_t seed = 1, const mesh::ParameterSpace& space = {}) {
    store::pb::JobRecord job;
    job.mutable_register_family()->set_family(id);
    job.mutable_register_family()->set_source(source);
    job.mutable_register_family()->add_targets(target);
    ASSERT_TRUE(catalog_->SubmitRegistration(job).ok());
    synthetic::ComplexOptions options;
    options.num_frames = kFamilyFrames;
    options.growth_per_frame = 0.05F;
    mesh::RegisteredFamily family = synthetic::MakeFamily(
        synthetic::MixedSphere(4, options), {{synthetic::SmoothWarp(seed, 0.1F, 0.3F), {}}});
    family.name = id;
    family.source = source;
    family.targets[0].name = target;
    family.parameter_space = space;
    auto writer = *blobs_->Create();
    ASSERT_TRUE(store::WriteFamily(family, *writer).ok());
    store::pb::FamilyRecord record;
    record.set_id(id);
    record.set_blob(*writer->Commit());
    *record.mutable_manifest() = store::ManifestOf(family);
    record.set_num_vertices(static_cast<int64_t>(family.vertices.size()));
    record.set_num_cells(family.num_cells());
    ASSERT_TRUE(catalog_->PublishFamily(TakeJob().lease_id, record).ok());
  }

  void PublishSplash() {
    ImportAnimation("a");
    ImportAnimation("b");
    PublishFamily("splash", "a", "b");
  }

  store::TemporaryFolder folder_;
  std::unique_ptr<store::Catalog> catalog_;
  std::unique_ptr<store::BlobStore> blobs_;
  catalog::Families families_;
};

}  // namespace liquidblend::rpc
