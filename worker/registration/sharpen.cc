#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "core/base/status_macros.h"
#include "worker/registration/compete.h"
#include "worker/registration/complete.h"
#include "worker/registration/features/automatic.h"
#include "worker/registration/features/rest.h"
#include "worker/registration/finer_nodes.h"
#include "worker/registration/finish/finish.h"
#include "worker/registration/fit/deformation.h"
#include "worker/registration/fit/hard_pins.h"
#include "worker/registration/fit/pins.h"
#include "worker/registration/fit/resume.h"
#include "worker/registration/register.h"
#include "worker/registration/transfer.h"

namespace liquidblend::registration {
namespace {

constexpr double kLargeFrom = 2.5;  // times the coarse mesh's vertices
// Options of a coarse registration: smallest diameter of a part (edges), and how long soft
// correspondences last.
constexpr double kSmallestCoarsePart = 2.0;
constexpr double kCoarseSoftRelease = 0.8;
constexpr int kTransferSweeps = 10;  // of the averaging over what came from single coarse vertices

absl::Status CheckCoarse(const CoarseRegistration& coarse) {
  const int64_t count = coarse.source.num_vertices();
  if (coarse.registration.displacement.cols() != count) {
    return absl::InvalidArgumentError(absl::StrCat("the coarse registration is of ",
                                                   coarse.registration.displacement.cols(),
                                                   " vertices, but the coarse source has ", count));
  }
  if (!coarse.registration.displacement.allFinite()) {
    return absl::InvalidArgumentError("the coarse registration is not finite");
  }
  return absl::OkStatus();
}

// Finds part motions and open starts from both animations' tracks, paired as in the coarse
// registration. Returns whether they fall from rest.
mesh::RestReport FollowTracks(const std::vector<Correspondence>& users,
                              const RegistrationOptions& options,
                              const mesh::RegistrationReport& coarse, SurfacePair& pair) {
  const Pairing pairing = KeptPairing(coarse.hypotheses, options.pairing);
  const TrackOptions tracks = {.min_diameter = options.smallest_part_edges};
  const Features source = FindTrackFeatures(pair.source, tracks),
                 target = FindTrackFeatures(pair.target, tracks);
  pair.MarkUnmatchedStarts(source, target);
  const FeaturePairs pairs = PairFeatures(source, target, ScaleOf(pair.source, pair.target),
                                          {.exchange = pairing == Pairing::kExchanged});
  const mesh::RestReport rest = FindRest(source, target, pairs.joined);
  pair.parts = PartsOfBoth(source, target, pairs.tracks);
  pair.times = TimesBlendOf(rest);
  if (options.IsGuidedBy(pairing)) pair.FindPartMotions(source, target, pairs, users);
  pair.HidePreRoll(source, target, pairs);
  return rest;
}

// Holds the hard pins on a fine mesh, with nodes as far apart as those of the coarse one.
class PinHolder {
 public:
  PinHolder(const SurfacePair& pair, const std::vector<Pin>& pins, double spacing, uint64_t seed,
            const parallel::Arena& arena)
      : arena_(arena) {
    std::vector<int32_t> vertices;
    for (const Pin& pin : pins) {
      if (pin.hard) vertices.push_back(pin.vertex);
    }
    if (vertices.empty()) return;
    nodes_.emplace(pair.source.points, pair.neighbors, spacing, vertices, seed, arena,
                   pair.source.rigid);
    pins_ = HardPins(*nodes_, pair.source.points, pins);
  }
  absl::Status Restore(Points& displacement) const {
    return nodes_ ? pins_.Restore(*nodes_, arena_, displacement) : absl::OkStatus();
  }

 private:
  const parallel::Arena& arena_;
  std::optional<DeformationNodes> nodes_;
  HardPins pins_;
};

// The automatic correspondences of the coarse registration.
std::vector<CorrespondenceReport> AutomaticOnes(const mesh::RegistrationReport& coarse) {
  std::vector<CorrespondenceReport> found;
  for (const CorrespondenceReport& report : coarse.correspondences) {
    if (report.automatic) found.push_back(report);
  }
  return found;
}

// Hands the current state to the hook that keeps it.
struct Keeper {
  const RegistrationHooks& hooks;
  absl::Time start;  // of the work, as if it had not been interrupted
  double Seconds() const { return absl::ToDoubleSeconds(absl::Now() - start); }
  void Keep(SharpenState& state) const {
    state.seconds = Seconds();
    if (hooks.keep) hooks.keep(state);
  }
};

// Runs the remaining rounds of finer nodes, and completes the registration.
absl::StatusOr<Registration> FinishSharpening(const SurfacePair& pair,
                                              const std::vector<Correspondence>& correspondences,
                                              SharpenState state,
                                              const RegistrationOptions& options,
                                              const parallel::Arena& arena, const Keeper& keeper) {
  const double edge = pair.source.mesh.edge_length_m;
  LB_RETURN_IF_ERROR(RefineUnderfitRegions(
      pair, options, arena, [&] { keeper.Keep(state); }, state));
  const double scale = state.coarse_edge_length_m / edge;
  // Points may be as far from the surface as in the coarse registration.
  const float on_surface = std::max(1.0f, static_cast<float>(scale)) * kOnSurfaceEdges;
  LB_ASSIGN_OR_RETURN(
      const std::vector<Pin> pins,
      ExpandCorrespondences(correspondences, pair.source, pair.target, arena, on_surface));
  LB_RETURN_IF_ERROR(CheckContradictions(pins, pair.source.points, edge));
  const double spacing = options.NodeSpacing(scale);
  const PinHolder holder(pair, pins, spacing, options.seed, arena);
  const auto hold_pins = [&](Points& moved) { return holder.Restore(moved); };
  LB_ASSIGN_OR_RETURN(Registration result, Complete(pair, std::move(state.displacement),
                                                    Detail::kHalf, hold_pins, arena));
  const mesh::RegistrationReport& before = state.coarse_report;
  result.report.correspondences =
      ReportCorrespondences(correspondences, pins, InEdgeUnits(result.displacement, edge), edge);
  for (const CorrespondenceReport& found : AutomaticOnes(before)) {
    result.report.correspondences.push_back(found);
  }
  result.report.num_nodes = before.num_nodes + state.num_finer_nodes;
  result.report.num_iterations = before.num_iterations;
  result.report.hypotheses = before.hypotheses;
  result.report.inlier_share = before.inlier_share;
  result.report.verdict.fit_energy = before.verdict.fit_energy;
  result.report.verdict.smoothness_energy = before.verdict.smoothness_energy;
  result.report.seconds = before.seconds + keeper.Seconds();
  return result;
}

}  // namespace

double CoarseScale(int64_t num_vertices, const RegistrationOptions& options) {
  const double ratio = static_cast<double>(num_vertices) / options.coarse_vertices;
  return ratio > kLargeFrom ? std::sqrt(ratio) : 1.0;
}

RegistrationOptions CoarseOptions(double scale, RegistrationOptions options) {
  options.smallest_part_edges =
      std::min(options.smallest_part_edges,
               std::max(kSmallestCoarsePart, options.smallest_part_edges / scale));
  options.soft_release = std::max(options.soft_release, kCoarseSoftRelease);
  return options;
}

absl::StatusOr<Registration> Sharpen(const mesh::SpaceTimeMesh& source,
                                     const mesh::SpaceTimeMesh& target,
                                     const std::vector<Correspondence>& correspondences,
                                     const CoarseRegistration& coarse,
                                     const RegistrationOptions& options,
                                     const parallel::Arena& arena, const RegistrationHooks& hooks) {
  LB_RETURN_IF_ERROR(options.Validate());
  LB_RETURN_IF_ERROR(CheckMeshes(source, target));
  LB_RETURN_IF_ERROR(CheckCoarse(coarse));
  const absl::Time start = absl::Now();
  SharpenState state;
  state.displacement = InEdgeUnits(Transfer(TransferSource(coarse.source, arena), source, arena)
                                       .Apply(coarse.registration.displacement, arena),
                                   source.edge_length_m);
  state.coarse_edge_length_m = coarse.source.edge_length_m;
  state.coarse_report = coarse.registration.report;
  SurfacePair pair(source, target, arena);
  const mesh::RestReport rest = FollowTracks(correspondences, options, state.coarse_report, pair);
  state.displacement = Smooth(state.displacement, pair.neighbors, kTransferSweeps, arena);
  const Keeper keeper{hooks, start};
  keeper.Keep(state);
  LB_ASSIGN_OR_RETURN(Registration result, FinishSharpening(pair, correspondences, std::move(state),
                                                            options, arena, keeper));
  result.report.rest = rest;
  return result;
}

absl::StatusOr<Registration> ResumeSharpening(const mesh::SpaceTimeMesh& source,
                                              const mesh::SpaceTimeMesh& target,
                                              const std::vector<Correspondence>& correspondences,
                                              const SharpenState& state,
                                              const RegistrationOptions& options,
                                              const parallel::Arena& arena,
                                              const RegistrationHooks& hooks) {
  LB_RETURN_IF_ERROR(options.Validate());
  LB_RETURN_IF_ERROR(CheckMeshes(source, target));
  LB_RETURN_IF_ERROR(CheckResumable(state, source.num_vertices()));
  const Keeper keeper{hooks, absl::Now() - absl::Seconds(state.seconds)};
  SurfacePair pair(source, target, arena);
  const mesh::RestReport rest = FollowTracks(correspondences, options, state.coarse_report, pair);
  LB_ASSIGN_OR_RETURN(Registration result,
                      FinishSharpening(pair, correspondences, state, options, arena, keeper));
  result.report.rest = rest;
  return result;
}

}  // namespace liquidblend::registration
