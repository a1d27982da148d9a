#include "worker/registration/fit/resume.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "core/base/status_macros.h"

namespace liquidblend::registration {
namespace {

using MapValues = std::array<float, 20>;

MapValues ValuesOf(const NodeMap& map) {
  MapValues values;
  Eigen::Map<NodeMap>(values.data()) = map;
  return values;
}

bool IsFinite(const MapValues& values) {
  return std::all_of(values.begin(), values.end(), [](float x) { return std::isfinite(x); });
}

absl::Status CheckIterationState(const IterationState& state, int num_iterations,
                                 size_t num_nodes) {
  const int iteration = state.last.iteration;
  if (state.last.num_iterations != num_iterations || iteration < 1 || iteration > num_iterations) {
    return absl::FailedPreconditionError(absl::StrCat("the state to go on from is after iteration ",
                                                      iteration, " of ", state.last.num_iterations,
                                                      ", and these are ", num_iterations));
  }
  if (state.maps.size() != num_nodes) {
    return absl::FailedPreconditionError(
        absl::StrCat("the state to go on from has ", state.maps.size(),
                     " deformation nodes, and there are ", num_nodes));
  }
  const auto broken = std::find_if_not(state.maps.begin(), state.maps.end(), IsFinite);
  if (broken != state.maps.end()) {
    return absl::FailedPreconditionError(absl::StrCat(
        "the state to go on from is not finite at deformation node ", broken - state.maps.begin()));
  }
  if (state.draws.size() == static_cast<size_t>(iteration)) return absl::OkStatus();
  return absl::FailedPreconditionError(absl::StrCat("the state to go on from has samples of ",
                                                    state.draws.size(), " iterations, not of ",
                                                    iteration));
}

}  // namespace

IterationState StateAfter(const IterationReport& last, const std::vector<NodeMap>& maps,
                          const Matcher& matcher, absl::Time start) {
  IterationState state;
  state.last = last;
  state.maps.reserve(maps.size());
  for (const NodeMap& map : maps) state.maps.push_back(ValuesOf(map));
  state.draws = matcher.draws();
  state.worst = matcher.worst();
  state.seconds = absl::ToDoubleSeconds(absl::Now() - start);
  return state;
}

absl::StatusOr<IterationReport> Resume(const RegistrationState& state, int num_iterations,
                                       Matcher& matcher, std::vector<NodeMap>& maps) {
  const auto* const iterations = std::get_if<IterationState>(&state);
  if (iterations == nullptr) {
    const bool is_of_finer_nodes = std::holds_alternative<SharpenState>(state);
    return absl::FailedPreconditionError(absl::StrCat(
        "the state to go on from is one of ", is_of_finer_nodes ? "finer nodes" : "other pairings",
        ", and these meshes are registered at once"));
  }
  LB_RETURN_IF_ERROR(CheckIterationState(*iterations, num_iterations, maps.size()));
  LB_RETURN_IF_ERROR(matcher.Resume(iterations->draws, iterations->worst));
  for (size_t n = 0; n < maps.size(); ++n) {
    maps[n] = Eigen::Map<const NodeMap>(iterations->maps[n].data());
  }
  return iterations->last;
}

absl::Status CheckResumable(const SharpenState& state, int64_t num_vertices) {
  if (state.displacement.cols() != num_vertices) {
    return absl::FailedPreconditionError(
        absl::StrCat("the state to go on from is of ", state.displacement.cols(),
                     " vertices, but the source has ", num_vertices));
  }
  if (!state.displacement.allFinite() || !(state.coarse_edge_length_m > 0)) {
    return absl::FailedPreconditionError(
        absl::StrCat("the state to go on from is not finite, or its coarse edges are ",
                     state.coarse_edge_length_m, " m long"));
  }
  return absl::OkStatus();
}

absl::Time StartOf(const RegistrationState* resumed) {
  const auto* const iterations =
      resumed == nullptr ? nullptr : std::get_if<IterationState>(resumed);
  return absl::Now() - absl::Seconds(iterations == nullptr ? 0.0 : iterations->seconds);
}

}  // namespace liquidblend::registration
