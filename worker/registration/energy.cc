#include "worker/registration/energy.h"

#include <Eigen/Cholesky>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "absl/strings/str_cat.h"
#include "worker/registration/normal_equations.h"

namespace liquidblend::registration {
namespace {

using NodeVector = std::vector<NodeMap>;
using Block = Eigen::Matrix<float, 20, 20>;
using BlockFactor = Eigen::LLT<Eigen::Matrix<double, 20, 20>>;

double Dot(const NodeVector& a, const NodeVector& b, const parallel::Arena& arena) {
  return arena.Sum(static_cast<int64_t>(a.size()), [&](int64_t n) {
    return a[n].cast<double>().cwiseProduct(b[n].cast<double>()).sum();
  });
}

// Block Jacobi: each node's own 20 x 20 block, factorised.
absl::StatusOr<std::vector<BlockFactor>> FactorBlocks(const NormalEquations& equations,
                                                      const parallel::Arena& arena) {
  const int64_t num_nodes = equations.num_nodes();
  std::vector<BlockFactor> factors(num_nodes);
  arena.For(
      num_nodes, [&](int64_t n) { factors[n].compute(equations.DiagonalBlock(n)); }, 16);
  for (int64_t n = 0; n < num_nodes; ++n) {
    if (factors[n].info() != Eigen::Success) {
      return absl::InternalError(
          absl::StrCat("the block of deformation node ", n, " is not positive definite"));
    }
  }
  return factors;
}

NodeMap ApplyInverse(const BlockFactor& factor, const NodeMap& residual) {
  const Eigen::Map<const Eigen::Matrix<float, 20, 1>> flat(residual.data());
  const Eigen::Matrix<double, 20, 1> solved = factor.solve(flat.cast<double>());
  NodeMap result;
  Eigen::Map<Eigen::Matrix<float, 20, 1>>(result.data()) = solved.cast<float>();
  return result;
}

// Preconditioned conjugate gradients, started from the given maps.
absl::StatusOr<int> SolveIteratively(const NormalEquations& equations, const SolverOptions& options,
                                     const parallel::Arena& arena, NodeVector& x) {
  const auto factors = FactorBlocks(equations, arena);
  if (!factors.ok()) return factors.status();
  const int64_t n = equations.num_nodes();
  const NodeVector rhs = equations.RightHandSide(arena);
  NodeVector r(n), z(n), p(n), ap(n);
  equations.Multiply(x, arena, ap);
  arena.For(n, [&](int64_t i) {
    r[i] = rhs[i] - ap[i];
    z[i] = ApplyInverse((*factors)[i], r[i]);
    p[i] = z[i];
  });
  const double goal_sq = options.tolerance * options.tolerance * Dot(rhs, rhs, arena);
  double rz = Dot(r, z, arena);
  int step = 0;
  for (; step < options.max_steps && Dot(r, r, arena) > goal_sq; ++step) {
    equations.Multiply(p, arena, ap);
    const double curvature = Dot(p, ap, arena);
    if (!(curvature > 0)) break;
    const float alpha = static_cast<float>(rz / curvature);
    arena.For(n, [&](int64_t i) {
      x[i] += alpha * p[i];
      r[i] -= alpha * ap[i];
      z[i] = ApplyInverse((*factors)[i], r[i]);
    });
    const double rz_next = Dot(r, z, arena);
    const float beta = static_cast<float>(rz_next / rz);
    rz = rz_next;
    arena.For(n, [&](int64_t i) { p[i] = z[i] + beta * p[i]; });
  }
  return step;
}

// Sparse Cholesky of the assembled normal equations.
absl::Status SolveDirectly(const NormalEquations& equations, const parallel::Arena& arena,
                           NodeVector& x) {
  const Eigen::SparseMatrix<double> matrix = equations.Assemble();
  const Eigen::SimplicialLLT<Eigen::SparseMatrix<double>> factor(matrix);
  if (factor.info() != Eigen::Success) {
    return absl::InternalError(
        absl::StrCat("the normal equations of ", matrix.rows(), " rows are not positive definite"));
  }
  const NodeVector rhs = equations.RightHandSide(arena);
  Eigen::VectorXd flat(matrix.rows());
  for (int64_t n = 0; n < equations.num_nodes(); ++n) {
    flat.segment<20>(20 * n) =
        Eigen::Map<const Eigen::Matrix<float, 20, 1>>(rhs[n].data()).cast<double>();
  }
  const Eigen::VectorXd solved = factor.solve(flat);
  for (int64_t n = 0; n < equations.num_nodes(); ++n) {
    Eigen::Map<Eigen::Matrix<float, 20, 1>>(x[n].data()) = solved.segment<20>(20 * n).cast<float>();
  }
  return absl::OkStatus();
}

}  // namespace

NodeGraph::NodeGraph(const DeformationNodes& nodes) {
  const int64_t num_nodes = nodes.num_nodes();
  for (int64_t to = 0; to < num_nodes; ++to) {
    for (const Influence& influence : nodes.influences(nodes.vertex(to))) {
      if (influence.node == to || !(influence.weight > 0)) continue;
      edges_.push_back({influence.node, static_cast<int32_t>(to), influence.weight,
                        nodes.position(to) - nodes.position(influence.node)});
    }
  }
  std::sort(edges_.begin(), edges_.end(), [](const Edge& a, const Edge& b) {
    return a.from != b.from ? a.from < b.from : a.to < b.to;
  });
  std::vector<float> sum(num_nodes, 0.0f);
  leaving_.begin.assign(num_nodes + 1, 0);
  arriving_.begin.assign(num_nodes + 1, 0);
  for (const Edge& edge : edges_) {
    sum[edge.from] += edge.weight;
    ++leaving_.begin[edge.from + 1];
    ++arriving_.begin[edge.to + 1];
  }
  for (Edge& edge : edges_) edge.weight /= sum[edge.from];
  for (IndexLists* lists : {&leaving_, &arriving_}) {
    std::partial_sum(lists->begin.begin(), lists->begin.end(), lists->begin.begin());
    lists->items.resize(edges_.size());
  }
  std::iota(leaving_.items.begin(), leaving_.items.end(), 0);
  std::vector<int64_t> next(arriving_.begin.begin(), arriving_.begin.end() - 1);
  for (size_t e = 0; e < edges_.size(); ++e) {
    arriving_.items[next[edges_[e].to]++] = static_cast<int32_t>(e);
  }
}

absl::StatusOr<SolveReport> Minimize(const DeformationNodes& nodes, const NodeGraph& graph,
                                     const Points& rest, const std::vector<FitTerm>& terms,
                                     const SolverOptions& options, const parallel::Arena& arena,
                                     std::vector<NodeMap>& maps) {
  const NormalEquations equations(nodes, graph, rest, terms, options, arena);
  SolveReport report;
  if (20 * nodes.num_nodes() <= options.max_direct_rows) {
    const absl::Status solved = SolveDirectly(equations, arena, maps);
    if (!solved.ok()) return solved;
  } else {
    const auto steps = SolveIteratively(equations, options, arena, maps);
    if (!steps.ok()) return steps.status();
    report.num_steps = *steps;
  }
  report.fit_energy = equations.FitEnergy(maps, arena);
  report.smoothness_energy = equations.SmoothnessEnergy(maps, arena);
  if (!std::isfinite(report.fit_energy) || !std::isfinite(report.smoothness_energy)) {
    return absl::InternalError("the energy is not finite");
  }
  return report;
}

}  // namespace liquidblend::registration
