// What slows conjugate gradients down while the surface is stiff: moves that many nodes make
// together. Internal to worker/registration.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "core/parallel/arena.h"
#include "worker/registration/fit/node_groups.h"
#include "worker/registration/fit/normal_equations.h"

namespace liquidblend::registration {

// The normal equations of groups of nodes, each of which moves by one affine map (Galerkin's).
// Threads: safe; same bytes for any thread count.
class CoarseSolver {
 public:
  // None if there are too few nodes to be worth it, or the groups' equations are not positive
  // definite for rounding: conjugate gradients do without then, in more steps.
  static std::optional<CoarseSolver> Make(const DeformationNodes& nodes,
                                          const NormalEquations& equations,
                                          const parallel::Arena& arena);
  // Adds to z the move of the groups that r asks for.
  void AddTo(const std::vector<NodeMap>& r, const parallel::Arena& arena,
             std::vector<NodeMap>& z) const;

 private:
  NodeGroups groups_;
  Eigen::MatrixXd factor_;  // L, with L L^T the groups' equations
};

}  // namespace liquidblend::registration
