#include "worker/registration/fit/coarse_solver.h"

#include <Eigen/Cholesky>

namespace liquidblend::registration {
namespace {

using DoubleMap = Eigen::Matrix<double, 4, 5>;

// Twice as many save a tenth of the steps and cost more than that.
constexpr int kNumGroups = 16;
constexpr int64_t kFewestNodes = 8;  // per group

}  // namespace

std::optional<CoarseSolver> CoarseSolver::Make(const DeformationNodes& nodes,
                                               const NormalEquations& equations,
                                               const parallel::Arena& arena) {
  if (nodes.num_nodes() < kFewestNodes * kNumGroups) return std::nullopt;
  CoarseSolver result;
  result.groups_ =
      GroupNodes(nodes, equations.graph(), equations.HeldNodes(), kNumGroups, kFewestNodes);
  if (result.groups_.size() == 0) return std::nullopt;
  const Eigen::LLT<Eigen::MatrixXd> factor(equations.AssembleFor(result.groups_, arena));
  if (factor.info() != Eigen::Success) return std::nullopt;
  result.factor_ = factor.matrixLLT();
  return result;
}

void CoarseSolver::AddTo(const std::vector<NodeMap>& r, const parallel::Arena& arena,
                         std::vector<NodeMap>& z) const {
  Eigen::VectorXd flat(factor_.rows());
  arena.For(
      groups_.size(),
      [&](int64_t c) {
        NodeMap sum = NodeMap::Zero();
        for (const int32_t n : groups_.nodes[c]) {
          sum += r[n];
          sum.leftCols<4>() += r[n].col(4) * groups_.offset.col(n).transpose();
        }
        Eigen::Map<DoubleMap>(flat.data() + 20 * c) = sum.cast<double>();
      },
      1);
  factor_.triangularView<Eigen::Lower>().solveInPlace(flat);
  factor_.triangularView<Eigen::Lower>().transpose().solveInPlace(flat);
  arena.For(static_cast<int64_t>(z.size()), [&](int64_t n) {
    if (groups_.of_node[n] < 0) return;
    const NodeMap move =
        Eigen::Map<const DoubleMap>(flat.data() + 20 * groups_.of_node[n]).cast<float>();
    z[n] += move;
    z[n].col(4) += move.leftCols<4>() * groups_.offset.col(n);
  });
}

}  // namespace liquidblend::registration
