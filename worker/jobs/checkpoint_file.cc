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

using registration::CompetitionState;
using registration::IterationState;
using registration::SharpenState;
using store::v1::CheckpointManifest;
using Float4 = std::array<float, 4>;

constexpr store::FileFormat kFormat = {"checkpoint file", "\x89LBCKP\r\n", 2, 1};
// Without other pairings.
constexpr store::FileFormat kPlainFormat = {kFormat.name, kFormat.magic, 1};
constexpr int kNumSections = 4;
constexpr int kNumBestSections = 3;  // beside them, while other pairings are tried
// Times stay in frames, as in target files.
constexpr double kFramesPerSecond = 1.0;
static_assert(sizeof(registration::SampleDraw) == 2 * sizeof(int32_t));

// The arrays of the iterations of one pairing.
struct IterationArrays {
  std::span<const std::array<float, 20>> maps = {};
  std::span<const registration::SampleDraw> draws = {};
  std::span<const int32_t> worst = {};
};

// The arrays of any kind of state; the others' are empty.
struct Arrays {
  IterationArrays iterations = {};
  std::span<const Float4> displacement = {};
  IterationArrays best = {};
};

// The iterations go into a manifest, or those of the best pairing into a message of its own.
template <typename Message>
IterationArrays DescribeIterations(const IterationState& state, Message& message) {
  message.set_iteration(state.last.iteration);
  message.set_num_iterations(state.last.num_iterations);
  message.set_fit_energy(state.last.fit_energy);
  message.set_smoothness_energy(state.last.smoothness_energy);
  message.set_num_inliers(state.last.num_inliers);
  message.set_num_samples(state.last.num_samples);
  message.set_seconds(state.seconds);
  return {.maps = state.maps, .draws = state.draws, .worst = state.worst};
}

Arrays Describe(const IterationState& state, CheckpointManifest& manifest) {
  return {.iterations = DescribeIterations(state, manifest)};
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

Arrays Describe(const CompetitionState& state, CheckpointManifest& manifest) {
  CheckpointManifest::Competition& competition = *manifest.mutable_competition();
  for (const mesh::Hypothesis& tried : state.tried) {
    store::v1::Hypothesis& added = *competition.add_tried();
    added.set_pairing(tried.pairing);
    added.set_cost(tried.cost);
    added.set_is_kept(tried.is_kept);
  }
  competition.set_num_others(state.num_others);
  Arrays arrays;
  arrays.best = DescribeIterations(state.best, *competition.mutable_best());
  if (state.next) arrays.iterations = DescribeIterations(*state.next, manifest);
  return arrays;
}

std::vector<store::SectionData> SectionsOf(const Arrays& arrays, bool has_best) {
  std::vector<store::SectionData> sections = {
      store::MakeSection("maps", arrays.iterations.maps),
      store::MakeSection("draws", arrays.iterations.draws),
      store::MakeSection("worst", arrays.iterations.worst),
      store::MakeSection("displacement", arrays.displacement)};
  if (has_best) {
    sections.push_back(store::MakeSection("best.maps", arrays.best.maps));
    sections.push_back(store::MakeSection("best.draws", arrays.best.draws));
    sections.push_back(store::MakeSection("best.worst", arrays.best.worst));
  }
  return sections;
}

absl::Status CheckManifest(const store::SectionReader& reader, const CheckpointManifest& manifest) {
  if (manifest.has_competition() != (reader.version() > kPlainFormat.version)) {
    return reader.Invalid(absl::StrCat("has ", manifest.has_competition() ? "other" : "no other",
                                       " pairings, in version ", reader.version()));
  }
  const int num_sections = kNumSections + (manifest.has_competition() ? kNumBestSections : 0);
  if (manifest.sections_size() != num_sections) {
    return reader.Invalid(
        absl::StrCat(manifest.sections_size(), " sections instead of ", num_sections));
  }
  if (manifest.has_competition() && manifest.has_finer_nodes()) {
    return reader.Invalid("has finer nodes and other pairings");
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
  LB_RETURN_IF_ERROR(reader.View(manifest.sections(0), "maps", arrays.iterations.maps));
  LB_RETURN_IF_ERROR(reader.View(manifest.sections(1), "draws", arrays.iterations.draws));
  LB_RETURN_IF_ERROR(reader.View(manifest.sections(2), "worst", arrays.iterations.worst));
  LB_RETURN_IF_ERROR(reader.View(manifest.sections(3), "displacement", arrays.displacement));
  if (manifest.has_competition()) {
    LB_RETURN_IF_ERROR(reader.View(manifest.sections(4), "best.maps", arrays.best.maps));
    LB_RETURN_IF_ERROR(reader.View(manifest.sections(5), "best.draws", arrays.best.draws));
    LB_RETURN_IF_ERROR(reader.View(manifest.sections(6), "best.worst", arrays.best.worst));
  }
  LB_RETURN_IF_ERROR(reader.Finish());
  return arrays;
}

template <typename Message>
IterationState IterationStateOf(const Message& message, const IterationArrays& arrays) {
  IterationState state;
  state.last.iteration = message.iteration();
  state.last.num_iterations = message.num_iterations();
  state.last.fit_energy = message.fit_energy();
  state.last.smoothness_energy = message.smoothness_energy();
  state.last.num_inliers = message.num_inliers();
  state.last.num_samples = message.num_samples();
  state.maps.assign(arrays.maps.begin(), arrays.maps.end());
  state.draws.assign(arrays.draws.begin(), arrays.draws.end());
  state.worst.assign(arrays.worst.begin(), arrays.worst.end());
  state.seconds = message.seconds();
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

CompetitionState CompetitionStateOf(const CheckpointManifest& manifest, const Arrays& arrays) {
  const CheckpointManifest::Competition& competition = manifest.competition();
  CompetitionState state;
  for (const store::v1::Hypothesis& tried : competition.tried()) {
    state.tried.push_back({tried.pairing(), tried.cost(), tried.is_kept()});
  }
  state.num_others = competition.num_others();
  state.best = IterationStateOf(competition.best(), arrays.best);
  if (manifest.iteration() > 0) state.next = IterationStateOf(manifest, arrays.iterations);
  return state;
}

registration::RegistrationState StateOf(const CheckpointManifest& manifest, const Arrays& arrays) {
  if (manifest.has_competition()) return CompetitionStateOf(manifest, arrays);
  if (manifest.has_finer_nodes()) return SharpenStateOf(manifest, arrays);
  return IterationStateOf(manifest, arrays.iterations);
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
  const bool has_best = manifest.has_competition();
  return store::WriteSectionFile(has_best ? kFormat : kPlainFormat, SectionsOf(arrays, has_best),
                                 manifest, *manifest.mutable_sections(), out);
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
  checkpoint.state = StateOf(manifest, arrays);
  return checkpoint;
}

}  // namespace liquidblend::jobs
