#include "worker/registration/fit/preconditioner.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace liquidblend::registration {
namespace {

using Column = Eigen::Matrix<double, 20, 1>;
using BlockFactor = Eigen::LLT<Eigen::Matrix<double, 20, 20>>;

// Row `component` of what the entry adds to C, as a column.
Column ConstraintColumn(const HardPins::Entry& entry, int component) {
  Column column = Column::Zero();
  for (int a = 0; a < 5; ++a) column[4 * a + component] = entry.coefficients[a];
  return column;
}

// Two products with it cost less than two triangles of M in double, one unknown after another.
Eigen::Matrix<float, 20, 20> InverseRoot(const BlockFactor& factor) {
  const Eigen::Matrix<double, 20, 20> root =
      factor.matrixL().solve(Eigen::Matrix<double, 20, 20>::Identity());
  return root.cast<float>();
}

// Of a block that rounding has left slightly indefinite, as where nodes are hundreds of frames
// apart, the factor of one with a larger diagonal: still a preconditioner, and only that.
BlockFactor FactorOf(const Eigen::Matrix<double, 20, 20>& block) {
  constexpr double kShifts[] = {1e-6, 1e-4, 1e-2};  // of the largest diagonal entry
  BlockFactor factor(block);
  for (const double shift : kShifts) {
    if (factor.info() == Eigen::Success) break;
    Eigen::Matrix<double, 20, 20> shifted = block;
    shifted.diagonal().array() += shift * block.diagonal().maxCoeff();
    factor.compute(shifted);
  }
  return factor;
}

struct PinEntry {
  int64_t pin;
  const HardPins::Entry* entry;
};

}  // namespace

absl::StatusOr<Preconditioner> Preconditioner::Make(const NormalEquations& equations,
                                                    const HardPins& pins,
                                                    const parallel::Arena& arena) {
  Preconditioner result(pins);
  const int64_t num_nodes = equations.num_nodes();
  result.inverse_root_.resize(num_nodes);
  std::vector<char> is_definite(num_nodes, 0);
  arena.For(
      num_nodes,
      [&](int64_t n) {
        const BlockFactor factor = FactorOf(equations.DiagonalBlock(n));
        is_definite[n] = factor.info() == Eigen::Success;
        if (is_definite[n] != 0) result.inverse_root_[n] = InverseRoot(factor);
      },
      16);
  for (int64_t n = 0; n < num_nodes; ++n) {
    if (is_definite[n] == 0) {
      return absl::InternalError(
          absl::StrCat("the block of deformation node ", n, " is not positive definite"));
    }
  }
  if (!pins.empty()) LB_RETURN_IF_ERROR(result.FactorConstraints());
  return result;
}

absl::Status Preconditioner::FactorConstraints() {
  std::vector<std::vector<PinEntry>> pins_of_node(inverse_root_.size());
  for (int64_t p = 0; p < pins_->num_pins(); ++p) {
    for (const HardPins::Entry& entry : pins_->entries(p)) {
      pins_of_node[entry.node].push_back({p, &entry});
    }
  }
  std::vector<Eigen::Triplet<double>> triplets;
  for (int64_t p = 0; p < pins_->num_pins(); ++p) {
    if (!pins_->pin(p).in_time) triplets.emplace_back(4 * p + 3, 4 * p + 3, 1.0);
  }
  for (size_t n = 0; n < inverse_root_.size(); ++n) {
    if (!pins_of_node[n].empty()) pinned_nodes_.push_back(static_cast<int32_t>(n));
    const Eigen::Matrix<double, 20, 20> root = inverse_root_[n].cast<double>();
    for (const PinEntry& a : pins_of_node[n]) {
      for (int i = 0; i < 4; ++i) {
        if (pins_->Mask(a.pin)[i] == 0) continue;
        const Column solved = root.transpose() * (root * ConstraintColumn(*a.entry, i));
        for (const PinEntry& b : pins_of_node[n]) {
          for (int j = 0; j < 4; ++j) {
            if (pins_->Mask(b.pin)[j] == 0) continue;
            triplets.emplace_back(4 * b.pin + j, 4 * a.pin + i,
                                  ConstraintColumn(*b.entry, j).dot(solved));
          }
        }
      }
    }
  }
  Eigen::SparseMatrix<double> matrix(4 * pins_->num_pins(), 4 * pins_->num_pins());
  matrix.setFromTriplets(triplets.begin(), triplets.end());
  constraints_ = std::make_unique<SparseFactor>(matrix);
  if (constraints_->info() != Eigen::Success) {
    return absl::InternalError(absl::StrCat("the constraints of ", pins_->num_pins(),
                                            " hard correspondences depend on one another"));
  }
  return absl::OkStatus();
}

NodeMap Preconditioner::Solve(int64_t node, const NodeMap& residual) const {
  const Eigen::Map<const Eigen::Matrix<float, 20, 1>> flat(residual.data());
  const Eigen::Matrix<float, 20, 1> half = inverse_root_[node] * flat;
  NodeMap result;
  Eigen::Map<Eigen::Matrix<float, 20, 1>>(result.data()).noalias() =
      inverse_root_[node].transpose().lazyProduct(half);
  return result;
}

void Preconditioner::Apply(const parallel::Arena& arena, std::vector<NodeMap>& r,
                           std::vector<NodeMap>& z) const {
  arena.For(static_cast<int64_t>(r.size()), [&](int64_t n) { z[n] = Solve(n, r[n]); });
  if (constraints_ == nullptr) return;
  const Eigen::VectorXd lambda = constraints_->solve(pins_->Apply(z));
  pins_->AddTransposed(lambda, -1.0, r);
  for (const int32_t n : pinned_nodes_) z[n] = Solve(n, r[n]);
}

void Preconditioner::Restore(std::vector<NodeMap>& x) const {
  if (constraints_ == nullptr) return;
  const Eigen::VectorXd lambda = constraints_->solve(pins_->Miss(x));
  std::vector<NodeMap> force(x.size(), NodeMap::Zero());
  pins_->AddTransposed(lambda, 1.0, force);
  for (const int32_t n : pinned_nodes_) x[n] += Solve(n, force[n]);
}

}  // namespace liquidblend::registration
