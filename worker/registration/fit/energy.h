// The quadratic energy of one iteration over the nodes' maps, and its minimiser (paper, sections
// 6.1 and 6.3). Internal to worker/registration.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/parallel/arena.h"
#include "worker/registration/fit/deformation.h"

namespace liquidblend::registration {

class HardPins;

// One fitting term: (u(v) - goal)^T metric (u(v) - goal), u(v) the displacement of vertex v.
// Equations 2 and 3 with correspondence c and normal N: goal = c - v and
// metric = weight (gamma_point I + gamma_plane N N^T).
struct FitTerm {
  int32_t vertex;
  Eigen::Vector4f goal;
  Eigen::Matrix4f metric;  // symmetric, positive semi-definite
};

struct SolverOptions {
  double smoothness = 250.0;  // gamma_s, equation 5, relative to the terms' total weight
  double damping = 1e-6;      // lambda, equation 6
  double tolerance = 1e-3;    // conjugate gradients: of the residual, relative
  int max_steps = 400;        // of conjugate gradients
  int max_direct_rows = 400;  // larger systems by conjugate gradients
};

struct SolveReport {
  double fit_energy = 0.0;         // after the step, over all terms
  double smoothness_energy = 0.0;  // equation 4
  int num_steps = 0;               // of conjugate gradients; 0: direct
};

// The pairs of nodes in the smoothness energy (equation 4).
class NodeGraph {
 public:
  struct Edge {
    int32_t from, to;        // the map of `from` predicts the node `to`
    float weight;            // w(n_i, n_j); adds up to 1 over each `from`
    Eigen::Vector4f offset;  // n_to - n_from
  };
  explicit NodeGraph(const DeformationNodes& nodes);
  // The same graph, each weight times the mean of the two nodes' factors.
  NodeGraph Stiffened(std::span<const float> factors) const;
  const std::vector<Edge>& edges() const { return edges_; }
  const IndexLists& leaving() const { return leaving_; }
  const IndexLists& arriving() const { return arriving_; }

 private:
  std::vector<Edge> edges_;  // by `from`, then `to`
  IndexLists leaving_;       // edges per `from`
  IndexLists arriving_;      // edges per `to`
};

// Minimises scale * sum of the terms + smoothness * equation 4, where scale = nodes / terms,
// starting from the given maps, which are replaced. The result obeys the constraints of `pins`.
// Errors: kInternal if a factorisation breaks down or a number is not finite.
// Threads: same bytes for any thread count.
absl::StatusOr<SolveReport> Minimize(const DeformationNodes& nodes, const NodeGraph& graph,
                                     const Points& rest, const std::vector<FitTerm>& terms,
                                     const HardPins& pins, const SolverOptions& options,
                                     const parallel::Arena& arena, std::vector<NodeMap>& maps);

}  // namespace liquidblend::registration
