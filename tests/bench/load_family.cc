#include "tests/bench/load_family.h"

#include <cmath>
#include <numbers>
#include <vector>

#include "core/base/status_macros.h"
#include "core/blend/blend.h"
#include "core/slice/slice.h"
#include "core/store/blobs/blob_store.h"
#include "core/store/catalog/catalog.h"
#include "core/store/files/files.h"
#include "core/store/open_store.h"
#include "tests/synthetic/families.h"

namespace liquidblend::bench {
namespace {

constexpr int kNumFrames = 40;

const std::string kSource = "source";
const std::string kTarget = "target";
const std::string kWorker = "load";

synthetic::Field TimeWarp(double warp_frames) {
  return [=](int64_t, const Eigen::Vector4f& at) {
    const double phase = std::numbers::pi * (2.0 * at[0] + at[1]);
    return Eigen::Vector4f(0.05F, 0.0F, 0.0F, static_cast<float>(warp_frames * std::sin(phase)));
  };
}

mesh::RegisteredFamily MakeFamily(int vertices_per_frame, double warp_frames) {
  const int num_minor = static_cast<int>(std::sqrt(vertices_per_frame / 2.0));
  synthetic::ComplexOptions options;
  options.num_frames = kNumFrames;
  options.growth_per_frame = 0.01F;
  mesh::RegisteredFamily family = synthetic::MakeFamily(
      synthetic::HexahedralTorus(vertices_per_frame / num_minor, num_minor, options),
      {{TimeWarp(warp_frames), {}}});
  family.name = "load";
  family.source = kSource;
  family.targets[0].name = kTarget;
  return family;
}

// Of its frames, over weights and times.
absl::StatusOr<double> MeanVertices(const mesh::RegisteredFamily& family) {
  constexpr int kNumSteps = 6;
  const slice::CellIndex index(family);
  slice::Workspace workspace;
  double num_vertices = 0.0;
  for (int w = 0; w < kNumSteps; ++w) {
    for (int t = 0; t < kNumSteps; ++t) {
      const std::vector<double> weights = {(w + 0.5) / kNumSteps};
      const double time_s = family.duration_s() * (t + 0.5) / kNumSteps;
      LB_RETURN_IF_ERROR(slice::FindCandidates(index, weights, time_s, workspace));
      const blend::Blender blender(family, weights);
      num_vertices += static_cast<double>(slice::March(index, blender, workspace).num_vertices());
    }
  }
  return num_vertices / (kNumSteps * kNumSteps);
}

// How many vertices the source's frames need for this many on average.
absl::StatusOr<int> SourceVertices(int vertices_per_frame, double warp_frames) {
  constexpr int kNumRounds = 3;
  double needed = vertices_per_frame;
  for (int round = 0; round < kNumRounds; ++round) {
    const auto now = static_cast<int>(needed);
    LB_ASSIGN_OR_RETURN(const double mean, MeanVertices(MakeFamily(now, warp_frames)));
    needed *= vertices_per_frame / mean;
  }
  return static_cast<int>(needed);
}

absl::Status Import(store::Catalog& catalog, const std::string& id) {
  store::pb::AnimationRecord animation;
  animation.set_id(id);
  store::pb::JobRecord job;
  job.mutable_import_animation()->set_animation(id);
  LB_RETURN_IF_ERROR(catalog.SubmitImport(animation, job).status());
  animation.mutable_manifest()->set_num_frames(kNumFrames);
  LB_ASSIGN_OR_RETURN(const auto lease, catalog.LeaseJob(kWorker, absl::Hours(1)));
  return catalog.PublishAnimation(lease->lease_id, animation);
}

absl::Status Publish(const mesh::RegisteredFamily& family, store::Catalog& catalog,
                     store::BlobStore& blobs) {
  store::pb::JobRecord job;
  job.mutable_register_family()->set_family(kLoadFamily);
  job.mutable_register_family()->set_source(kSource);
  job.mutable_register_family()->add_targets(kTarget);
  LB_RETURN_IF_ERROR(catalog.SubmitRegistration(job).status());
  LB_ASSIGN_OR_RETURN(const auto writer, blobs.Create());
  LB_RETURN_IF_ERROR(store::WriteFamily(family, *writer));
  store::pb::FamilyRecord record;
  record.set_id(kLoadFamily);
  LB_ASSIGN_OR_RETURN(*record.mutable_blob(), writer->Commit());
  *record.mutable_manifest() = store::ManifestOf(family);
  LB_ASSIGN_OR_RETURN(const auto lease, catalog.LeaseJob(kWorker, absl::Hours(1)));
  return catalog.PublishFamily(lease->lease_id, record).status();
}

}  // namespace

absl::StatusOr<int> MakeLoadFamily(const std::string& data_directory, int vertices_per_frame,
                                   double warp_frames) {
  store::StoreLocation location;
  location.data = data_directory;
  LB_ASSIGN_OR_RETURN(const store::Store store, store::OpenStore(location));
  LB_RETURN_IF_ERROR(Import(*store.catalog, kSource));
  LB_RETURN_IF_ERROR(Import(*store.catalog, kTarget));
  LB_ASSIGN_OR_RETURN(const int source_vertices, SourceVertices(vertices_per_frame, warp_frames));
  LB_RETURN_IF_ERROR(
      Publish(MakeFamily(source_vertices, warp_frames), *store.catalog, *store.blobs));
  return source_vertices;
}

}  // namespace liquidblend::bench
