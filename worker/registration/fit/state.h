// State of an interrupted registration, from which it resumes on any machine to the same bytes.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <variant>
#include <vector>

#include "core/mesh/registered_family.h"

namespace liquidblend::registration {

struct IterationReport {
  int iteration = 0;  // from 1
  int num_iterations = 0;
  double fit_energy = 0.0;
  double smoothness_energy = 0.0;
  int64_t num_inliers = 0;
  int64_t num_samples = 0;
};

// Numbers of vertices that one iteration drew at random.
struct SampleDraw {
  int32_t num_source = 0;
  int32_t num_target = 0;
};

// State after an iteration of Register() or Refine(): all input of the next one beside the
// arguments. Graphs, features, correspondences and nodes follow from the arguments and are made
// anew. So are the random numbers, by drawing as many as before.
struct IterationState {
  IterationReport last;                     // of that iteration
  std::vector<std::array<float, 20>> maps;  // per node: X, column by column, then b
  std::vector<SampleDraw> draws;            // per iteration
  std::vector<int32_t> worst;               // source vertices of the last samples, furthest first
  double seconds = 0.0;                     // worked so far
};

// State after the coarse registration was carried over to the fine meshes, or after a round of
// finer nodes. The coarse meshes are not needed any more.
struct SharpenState {
  int num_rounds = 0;             // of finer nodes, done or not needed
  int num_finer_nodes = 0;        // of these rounds
  Eigen::Matrix4Xf displacement;  // per vertex of the fine source: mean edges and frames
  double coarse_edge_length_m = 0.0;
  mesh::RegistrationReport coarse_report;
  double seconds = 0.0;  // worked since the coarse registration
};

// State while other pairings compete with the first one (compete.h): after a pairing, or after an
// iteration of the next one. Pairings that are done are not registered again; the best one's
// displacement follows from its last iteration.
struct CompetitionState {
  std::vector<mesh::Hypothesis> tried;  // as far as they could be registered; none is kept yet
  int num_others = 0;                   // pairings beside the first one that were tried
  IterationState best;                  // of the best one so far, after its last iteration
  std::optional<IterationState> next;   // of the one after those tried; nothing: it has not begun
};

using RegistrationState = std::variant<IterationState, SharpenState, CompetitionState>;

// Called after each iteration; returning false cancels (kCancelled).
using ProgressCallback = std::function<bool(const IterationReport&)>;

// Hooks of a registration: saving and restoring of its state.
struct RegistrationHooks {
  ProgressCallback progress = {};
  // Called after each iteration (before `progress`), each round of finer nodes, and each pairing
  // that competes. Cost: a copy of the state.
  std::function<void(RegistrationState)> keep = {};
  // The state to resume, of the same call with the same arguments. Null: from the beginning.
  // Errors: kFailedPrecondition if it is not.
  const RegistrationState* resume = nullptr;
};

}  // namespace liquidblend::registration
