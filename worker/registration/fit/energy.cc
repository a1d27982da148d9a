#include "worker/registration/fit/energy.h"

#include <Eigen/Cholesky>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "worker/registration/fit/coarse_solver.h"
#include "worker/registration/fit/hard_pins.h"
#include "worker/registration/fit/normal_equations.h"
#include "worker/registration/fit/preconditioner.h"

namespace liquidblend::registration {
namespace {

using NodeVector = std::vector<NodeMap>;

// Below it the groups' equations take longer than the steps that they save.
constexpr double kCoarseFromSmoothness = 10;

double Dot(const NodeVector& a, const NodeVector& b, const parallel::Arena& arena) {
  return arena.Sum(static_cast<int64_t>(a.size()), [&](int64_t n) {
    return a[n].cast<double>().cwiseProduct(b[n].cast<double>()).sum();
  });
}

// The right-hand side once what the pins hold is substituted: the residual of the least maps that
// obey them. Its size is what the solver's tolerance is relative to.
double SizeOfRightHandSide(const NormalEquations& equations, const NodeVector& rhs,
                           const HardPins& pins, const Preconditioner& preconditioner,
                           const parallel::Arena& arena) {
  if (pins.empty()) return Dot(rhs, rhs, arena);
  NodeVector least(rhs.size(), NodeMap::Zero()), r(rhs.size()), z(rhs.size());
  preconditioner.Restore(least);
  equations.Multiply(least, arena, r);
  for (size_t n = 0; n < rhs.size(); ++n) r[n] = rhs[n] - r[n];
  preconditioner.Apply(arena, r, z);
  return Dot(r, r, arena);
}

// Preconditioned conjugate gradients, started from the given maps.
absl::StatusOr<int> SolveIteratively(const DeformationNodes& nodes,
                                     const NormalEquations& equations, const HardPins& pins,
                                     const SolverOptions& options, const parallel::Arena& arena,
                                     NodeVector& x) {
  LB_ASSIGN_OR_RETURN(const Preconditioner preconditioner,
                      Preconditioner::Make(equations, pins, arena));
  std::optional<CoarseSolver> coarse;
  // Not with pins, as the groups' moves would violate their constraints.
  if (pins.empty() && options.smoothness >= kCoarseFromSmoothness) {
    coarse = CoarseSolver::Make(nodes, equations, arena);
  }
  const auto precondition = [&](NodeVector& residual, NodeVector& z) {
    preconditioner.Apply(arena, residual, z);
    if (coarse) coarse->AddTo(residual, arena, z);
  };
  const int64_t n = equations.num_nodes();
  const NodeVector rhs = equations.RightHandSide(arena);
  const double goal_sq = options.tolerance * options.tolerance *
                         SizeOfRightHandSide(equations, rhs, pins, preconditioner, arena);
  NodeVector r(n), z(n), ap(n);
  preconditioner.Restore(x);
  equations.Multiply(x, arena, ap);
  arena.For(n, [&](int64_t i) { r[i] = rhs[i] - ap[i]; });
  precondition(r, z);
  NodeVector p = z;
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
    });
    precondition(r, z);
    const double rz_next = Dot(r, z, arena);
    const float beta = static_cast<float>(rz_next / rz);
    rz = rz_next;
    arena.For(n, [&](int64_t i) { p[i] = z[i] + beta * p[i]; });
  }
  preconditioner.Restore(x);  // of rounding
  return step;
}

// C^T, without the columns of components that are free, and the goals of the others.
struct DenseConstraints {
  Eigen::MatrixXd transposed;
  Eigen::VectorXd goals;
};

DenseConstraints ConstraintsOf(const HardPins& pins, int64_t num_rows) {
  DenseConstraints result;
  result.transposed.setZero(num_rows, 4 * pins.num_pins());
  result.goals.setZero(4 * pins.num_pins());
  Eigen::Index row = 0;
  for (int64_t p = 0; p < pins.num_pins(); ++p) {
    for (int i = 0; i < (pins.pin(p).in_time ? 4 : 3); ++i, ++row) {
      result.goals[row] = pins.pin(p).goal[i];
      for (const HardPins::Entry& entry : pins.entries(p)) {
        for (int a = 0; a < 5; ++a) {
          result.transposed(20 * entry.node + 4 * a + i, row) = entry.coefficients[a];
        }
      }
    }
  }
  result.transposed.conservativeResize(Eigen::NoChange, row);
  result.goals.conservativeResize(row);
  return result;
}

// Sparse Cholesky of the assembled normal equations; the constraints by their Schur complement.
absl::Status SolveDirectly(const NormalEquations& equations, const HardPins& pins,
                           const parallel::Arena& arena, NodeVector& x) {
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
  Eigen::VectorXd solved = factor.solve(flat);
  if (!pins.empty()) {
    const DenseConstraints constraints = ConstraintsOf(pins, matrix.rows());
    const Eigen::MatrixXd moves = factor.solve(constraints.transposed);
    const Eigen::LLT<Eigen::MatrixXd> schur(constraints.transposed.transpose() * moves);
    if (schur.info() != Eigen::Success) {
      return absl::InternalError(absl::StrCat("the constraints of ", pins.num_pins(),
                                              " hard correspondences depend on one another"));
    }
    const Eigen::VectorXd miss = constraints.goals - constraints.transposed.transpose() * solved;
    solved += moves * schur.solve(miss);
  }
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

NodeGraph NodeGraph::Stiffened(std::span<const float> factors) const {
  NodeGraph result = *this;
  for (Edge& edge : result.edges_) edge.weight *= 0.5f * (factors[edge.from] + factors[edge.to]);
  return result;
}

absl::StatusOr<SolveReport> Minimize(const DeformationNodes& nodes, const NodeGraph& graph,
                                     const Points& rest, const std::vector<FitTerm>& terms,
                                     const HardPins& pins, const SolverOptions& options,
                                     const parallel::Arena& arena, std::vector<NodeMap>& maps) {
  const NormalEquations equations(nodes, graph, rest, terms, options, arena);
  SolveReport report;
  if (20 * nodes.num_nodes() <= options.max_direct_rows) {
    const absl::Status solved = SolveDirectly(equations, pins, arena, maps);
    if (!solved.ok()) return solved;
  } else {
    const auto steps = SolveIteratively(nodes, equations, pins, options, arena, maps);
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
