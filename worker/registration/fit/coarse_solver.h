// Coarse correction of the preconditioner: joint moves of many nodes, which slow conjugate
// gradients down while the surface is stiff. Internal to worker/registration.
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
  // Nothing if there are too few nodes, or if rounding makes the groups' equations indefinite.
  // Conjugate gradients then take more steps without it.
  static std::optional<CoarseSolver> Make(const DeformationNodes& nodes,
                                          const NormalEquations& equations,
                                          const parallel::Arena& arena);
  // Adds to z the solution of the groups' equations for r.
  void AddTo(const std::vector<NodeMap>& r, const parallel::Arena& arena,
             std::vector<NodeMap>& z) const;

 private:
  NodeGroups groups_;
  Eigen::MatrixXd factor_;  // L, with L L^T the groups' equations
};

}  // namespace liquidblend::registration
