// Normal equations of the quadratic energy (equation 6), without assembling them unless asked.
// Internal to worker/registration.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <vector>

#include "core/parallel/arena.h"
#include "worker/registration/deformation.h"
#include "worker/registration/energy.h"

namespace liquidblend::registration {

// A x = rhs over x = [X | b] of all nodes, a 4 x 5 matrix each (20 unknowns, column by column).
// Threads: safe; same bytes for any thread count.  Memory: about 30 bytes per term and influence.
class NormalEquations {
 public:
  NormalEquations(const DeformationNodes& nodes, const NodeGraph& graph, const Points& rest,
                  const std::vector<FitTerm>& terms, const SolverOptions& options,
                  const parallel::Arena& arena);

  int64_t num_nodes() const { return num_nodes_; }
  void Multiply(const std::vector<NodeMap>& x, const parallel::Arena& arena,
                std::vector<NodeMap>& result) const;
  std::vector<NodeMap> RightHandSide(const parallel::Arena& arena) const;
  Eigen::Matrix<double, 20, 20> DiagonalBlock(int64_t node) const;
  Eigen::SparseMatrix<double> Assemble() const;

  double FitEnergy(const std::vector<NodeMap>& x, const parallel::Arena& arena) const;
  double SmoothnessEnergy(const std::vector<NodeMap>& x, const parallel::Arena& arena) const;

 private:
  using Coefficients = std::array<float, 5>;  // weight * (v - n, 1)

  Eigen::Vector4f Displacement(int64_t term, const std::vector<NodeMap>& x) const;
  Eigen::Vector4f Prediction(const NodeGraph::Edge& edge, const std::vector<NodeMap>& x) const;
  // Sums fit[term] and edge residuals back onto the nodes.
  void Gather(const std::vector<Eigen::Vector4f>& of_term,
              const std::vector<Eigen::Vector4f>& of_edge, const parallel::Arena& arena,
              std::vector<NodeMap>& result) const;

  const NodeGraph& graph_;
  const std::vector<FitTerm>& terms_;
  int64_t num_nodes_;
  float fit_scale_;
  float smoothness_;
  float damping_;
  IndexLists node_of_;                      // per term: nodes of its entries
  std::vector<Coefficients> coefficients_;  // per entry
  IndexLists entries_of_;                   // per node: its entries ...
  std::vector<int32_t> term_of_;            // ... and the term of each, in the same order
};

}  // namespace liquidblend::registration
