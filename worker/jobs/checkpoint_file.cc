#include "worker/jobs/checkpoint_file.h"

#include <algorithm>
#include <array>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/store/files/correspondence_records.h"
#include "core/store/files/report_messages.h"
#include "core/store/files/sections.h"
#include "liquidblend/store/v1/files.pb.h"
#include "worker/registration/fit/state.h"

namespace liquidblend::jobs {
namespace {

using registration::IterationState;
using registration::SharpenState;
using store::v1::CheckpointManifest;
using Float4 = std::array<float, 4>;

constexpr store::FileFormat kFormat = {"checkpoint file", "\x89LBCKP\r\n", 1};
constexpr int kNumSections = 4;
// Times stay in frames, as in target files.
constexpr double kFramesPerSecond = 1.0;
static_assert(sizeof(registration::SampleDraw) == 2 * sizeof(int32_t));

// The arrays of either kind of state; the other's are empty.
struct Arrays {
  std::span<const std::array<float, 20>> maps = {};
  std::span<const registration::SampleDraw> draws = {};
  std::span<const int32_t> worst = {};
  std::span<const Float4> displacement = {};
};

Arrays Describe(const IterationState& state, CheckpointManifest& manifest) {
  manifest.set_iteration(state.last.iteration);
  manifest.set_num_iterations(state.last.num_iterations);
  manifest.set_fit_energy(state.last.fit_energy);
  manifest.set_smoothness_energy(state.last.smoothness_energy);
  manifest.set_num_inliers(state.last.num_inliers);
  manifest.set_num_samples(state.last.num_samples);
  manifest.set_seconds(state.seconds);
  return {.maps = state.maps, .draws = state.draws, .worst = state.worst};
}

Arrays Describe(const SharpenState& state, CheckpointManifest& manifest) {
  CheckpointManifest::FinerNodes& finer = *manifest.mutable_finer_nodes();
  finer.set_num_rounds(state.num_rounds);
  finer.set_num_nodes(state.num_finer_nodes);
  finer.set_coarse_edge_length_m(state.coarse_edge_length_m);
  mesh::FamilyTarget coarse;
  coarse.report = state.coarse_report;
  *finer.mutable_coarse_report() = store::ToMessage(coarse, kFramesPerSecond);
  manifest.set_iteration(state.coarse_report.num_iterations);
  manifest.set_num_iterations(state.coarse_report.num_iterations);
  manifest.set_seconds(state.seconds);
  return {.displacement = {reinterpret_cast<const Float4*>(state.displacement.data()),
                           static_cast<size_t>(state.displacement.cols())}};
}

absl::Status CheckManifest(const store::SectionReader& reader, const CheckpointManifest& manifest) {
  if (manifest.sections_size() != kNumSections) {
    return reader.Invalid(
        absl::StrCat(manifest.sections_size(), " sections instead of ", kNumSections));
  }
  for (const auto& found : manifest.finer_nodes().coarse_report().correspondences()) {
    if (!store::IsWhole(found)) {
      return reader.Invalid("a correspondence's event is not four numbers");
    }
  }
  return absl::OkStatus();
}

absl::StatusOr<Arrays> ReadArrays(const CheckpointManifest& manifest,
                                  store::SectionReader& reader) {
  Arrays arrays;
  LB_RETURN_IF_ERROR(reader.View(manifest.sections(0), "maps", arrays.maps));
  LB_RETURN_IF_ERROR(reader.View(manifest.sections(1), "draws", arrays.draws));
  LB_RETURN_IF_ERROR(reader.View(manifest.sections(2), "worst", arrays.worst));
  LB_RETURN_IF_ERROR(reader.View(manifest.sections(3), "displacement", arrays.displacement));
  LB_RETURN_IF_ERROR(reader.Finish());
  return arrays;
}

IterationState IterationStateOf(const CheckpointManifest& manifest, const Arrays& arrays) {
  IterationState state;
  state.last.iteration = manifest.iteration();
  state.last.num_iterations = manifest.num_iterations();
  state.last.fit_energy = manifest.fit_energy();
  state.last.smoothness_energy = manifest.smoothness_energy();
  state.last.num_inliers = manifest.num_inliers();
  state.last.num_samples = manifest.num_samples();
  state.maps.assign(arrays.maps.begin(), arrays.maps.end());
  state.draws.assign(arrays.draws.begin(), arrays.draws.end());
  state.worst.assign(arrays.worst.begin(), arrays.worst.end());
  state.seconds = manifest.seconds();
  return state;
}

SharpenState SharpenStateOf(const CheckpointManifest& manifest, const Arrays& arrays) {
  const CheckpointManifest::FinerNodes& finer = manifest.finer_nodes();
  SharpenState state;
  state.num_rounds = finer.num_rounds();
  state.num_finer_nodes = finer.num_nodes();
  state.displacement =
      Eigen::Map<const Eigen::Matrix4Xf>(reinterpret_cast<const float*>(arrays.displacement.data()),
                                         4, static_cast<Eigen::Index>(arrays.displacement.size()));
  state.coarse_edge_length_m = finer.coarse_edge_length_m();
  state.coarse_report = store::FromMessage(finer.coarse_report(), kFramesPerSecond);
  state.seconds = manifest.seconds();
  return state;
}

}  // namespace

absl::Status WriteCheckpoint(const CheckpointLabel& label,
                             const registration::RegistrationState& state, store::BlobWriter& out) {
  CheckpointManifest manifest;
  manifest.set_fingerprint(label.fingerprint);
  manifest.set_lease(label.lease);
  manifest.set_number(label.number);
  const Arrays arrays =
      std::visit([&](const auto& kind) { return Describe(kind, manifest); }, state);
  const std::vector<store::SectionData> sections = {
      store::MakeSection("maps", arrays.maps), store::MakeSection("draws", arrays.draws),
      store::MakeSection("worst", arrays.worst),
      store::MakeSection("displacement", arrays.displacement)};
  return store::WriteSectionFile(kFormat, sections, manifest, *manifest.mutable_sections(), out);
}

absl::StatusOr<Checkpoint> ReadCheckpoint(const store::Blob& blob, const std::string& name) {
  store::SectionReader reader(kFormat, name, blob.bytes());
  LB_RETURN_IF_ERROR(reader.CheckAlignment());
  CheckpointManifest manifest;
  LB_RETURN_IF_ERROR(reader.ReadManifest(manifest));
  LB_RETURN_IF_ERROR(CheckManifest(reader, manifest));
  LB_ASSIGN_OR_RETURN(const Arrays arrays, ReadArrays(manifest, reader));
  Checkpoint checkpoint;
  checkpoint.label = {manifest.fingerprint(), manifest.lease(), manifest.number()};
  if (manifest.has_finer_nodes()) {
    checkpoint.state = SharpenStateOf(manifest, arrays);
  } else {
    checkpoint.state = IterationStateOf(manifest, arrays);
  }
  return checkpoint;
}

}  // namespace liquidblend::jobs
