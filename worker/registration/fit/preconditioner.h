// Block Jacobi within the hard correspondences' constraints. Internal to worker/registration.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <memory>
#include <vector>

#include "absl/status/statusor.h"
#include "worker/registration/fit/hard_pins.h"
#include "worker/registration/fit/normal_equations.h"

namespace liquidblend::registration {

// M: each node's own 20 x 20 block, factorised. Search directions made by Apply() lie in the null
// space of the constraints, so conjugate gradients never violate them (Gould, Hribar, Nocedal
// 2001).  Threads: safe; same bytes for any thread count.
class Preconditioner {
 public:
  // Errors: kInternal if a node's block, or the constraints' system, is not positive definite.
  // Both arguments must outlive it.
  static absl::StatusOr<Preconditioner> Make(const NormalEquations& equations, const HardPins& pins,
                                             const parallel::Arena& arena);

  // z = M^-1 r with C z = 0. Projects r onto the null space of C: its part in the range of C^T has
  // no effect on z.
  void Apply(const parallel::Arena& arena, std::vector<NodeMap>& r, std::vector<NodeMap>& z) const;

  // Replaces x by the nearest x, in the metric of M, that obeys the constraints.
  void Restore(std::vector<NodeMap>& x) const;

 private:
  using Block = Eigen::Matrix<float, 20, 20>;
  using SparseFactor = Eigen::SimplicialLLT<Eigen::SparseMatrix<double>>;

  explicit Preconditioner(const HardPins& pins) : pins_(&pins) {}
  NodeMap Solve(int64_t node, const NodeMap& residual) const;
  absl::Status FactorConstraints();

  const HardPins* pins_;
  // Per node W, with M^-1 = W^T W: positive definite, however W is rounded, and more accurate in
  // float than M^-1 itself, as M's condition is up to 1e11 where few edges and terms hold a node.
  std::vector<Block> inverse_root_;
  std::vector<int32_t> pinned_nodes_;          // those that move a pin, ascending
  std::unique_ptr<SparseFactor> constraints_;  // of C M^-1 C^T; none without pins
};

}  // namespace liquidblend::registration
