// A store in a temporary folder, with animations and small families in it, and what methods need.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/synchronization/notification.h"
#include "core/base/status_macros.h"
#include "core/store/blobs/blob_store.h"
#include "core/store/catalog/catalog.h"
#include "core/store/data_directory.h"
#include "core/store/files/files.h"
#include "google/rpc/error_details.pb.h"
#include "server/base/errors.h"
#include "server/frames/backends.h"
#include "server/frames/frame_stream.h"
#include "server/frames/get_frame.h"
#include "tests/core/store/store_testing.h"
#include "tests/synthetic/families.h"

namespace liquidblend::server {

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

// A GetFrame call from beginning to end.
inline absl::StatusOr<v1::Frame> GetFrame(Backends& backends, const v1::GetFrameRequest& request) {
  absl::StatusOr<AnsweredFrame> result;
  absl::Notification is_done;
  FrameCall::Start(backends, request, "test", [&](absl::StatusOr<AnsweredFrame> made) {
    result = std::move(made);
    is_done.Notify();
  });
  is_done.WaitForNotification();
  if (!result.ok()) return result.status();
  v1::Frame frame;
  EXPECT_TRUE(frame.ParseFromString(*result->bytes));
  return frame;
}

// A FrameStream whose families are found and whose frames are made at once.
class SimpleStream {
 public:
  explicit SimpleStream(catalog::Families& families) : families_(families) {}

  absl::Status Change(const v1::StreamFramesRequest& request) {
    LB_ASSIGN_OR_RETURN(const std::optional<std::string> id, stream.FamilyToFind(request));
    catalog::FamilyPtr found;
    if (id.has_value()) {
      LB_ASSIGN_OR_RETURN(found, families_.Get(*id));
    }
    return stream.Change(request, found, absl::ZeroDuration());
  }

  // What the client reads.
  absl::StatusOr<v1::StreamFramesResponse> Make(const FramePacer::Tick& tick) {
    FrameBuffers buffers;
    const FrameQuery query = stream.QueryAt(tick);
    LB_ASSIGN_OR_RETURN(const v1::Frame frame, MakeFrame(*stream.loaded(), query, buffers));
    const StreamedFrame streamed =
        stream.Sent(query, std::make_shared<const std::string>(frame.SerializeAsString()));
    v1::StreamFramesResponse response;
    EXPECT_TRUE(response.ParseFromString(ResponsePrefix(streamed) + *streamed.frame));
    return response;
  }

  absl::StatusOr<v1::StreamFramesResponse> MakeNext() {
    return Make(*stream.Next(absl::ZeroDuration()));
  }

  FrameStream stream;

 private:
  catalog::Families& families_;
};

// The google.rpc detail that a status carries under `url`; empty if there is none.
template <typename Detail>
Detail PayloadOf(const absl::Status& status, const char* url) {
  Detail detail;
  const absl::optional<absl::Cord> payload = status.GetPayload(url);
  if (payload.has_value()) detail.ParseFromString(std::string(*payload));
  return detail;
}

inline absl::Duration RetryDelayOf(const absl::Status& status) {
  const auto delay = PayloadOf<google::rpc::RetryInfo>(status, kRetryInfoUrl).retry_delay();
  return absl::Seconds(delay.seconds()) + absl::Nanoseconds(delay.nanos());
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
    limits.max_all_correspondences = 3;
    limits.watch_interval = absl::Milliseconds(5);
    return limits;
  }

  static BackendsOptions SmallBackends() {
    BackendsOptions options;
    options.limits = SmallLimits();
    options.num_io_threads = 1;
    options.num_frame_threads = 1;
    return options;
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

  // An animation that can be registered.
  static store::pb::AnimationManifest SmallManifest() {
    store::pb::AnimationManifest manifest;
    manifest.set_num_frames(kFamilyFrames);
    manifest.set_frames_per_second(24);
    manifest.set_mean_edge_length_m(0.1);
    return manifest;
  }

  void ImportAnimation(const std::string& id,
                       const store::pb::AnimationManifest& manifest = SmallManifest()) {
    SubmitImport(id);
    store::pb::AnimationRecord animation;
    animation.set_id(id);
    *animation.mutable_manifest() = manifest;
    EXPECT_TRUE(catalog_->PublishAnimation(TakeJob().lease_id, animation).ok());
  }

  // A growing sphere and one target that moves every vertex by up to 0.1 m. The animations that it
  // is made of must be there.
  void PublishFamily(const std::string& id, const std::string& source, const std::string& target,
                     uint64_t seed = 1, const mesh::ParameterSpace& space = {},
                     int num_coarser_levels = 0) {
    store::pb::JobRecord job;
    job.mutable_register_family()->set_family(id);
    job.mutable_register_family()->set_source(source);
    job.mutable_register_family()->add_targets(target);
    job.mutable_register_family()->set_keep_versions(keep_versions_);
    ASSERT_TRUE(catalog_->SubmitRegistration(job).ok());
    synthetic::ComplexOptions options;
    options.num_frames = kFamilyFrames;
    options.growth_per_frame = 0.05F;
    const auto make = [&](int cells_per_side) {
      return synthetic::MakeFamily(synthetic::MixedSphere(cells_per_side, options),
                                   {{synthetic::SmoothWarp(seed, 0.1F, 0.3F), {}}});
    };
    mesh::RegisteredFamily family = make(4);
    for (int k = 1; k <= num_coarser_levels; ++k) family.coarser_levels.push_back(make(4 - k));
    family.name = id;
    family.source = source;
    family.targets[0].name = target;
    family.parameter_space = space;
    auto writer = *blobs_->Create();
    ASSERT_TRUE(store::WriteFamily(family, *writer).ok());
    store::pb::FamilyRecord record;
    record.set_id(id);
    record.set_blob(*writer->Commit());
    record.set_size_bytes(static_cast<int64_t>((*blobs_->Open(record.blob()))->bytes().size()));
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

  int keep_versions_ = 1;  // of PublishFamily()
  store::TemporaryFolder folder_;
  std::unique_ptr<store::Catalog> catalog_;
  std::unique_ptr<store::BlobStore> blobs_;
  catalog::Families families_;
};

}  // namespace liquidblend::server
