// Normal equations of the quadratic energy (equation 6), without assembling them unless asked.
// Internal to worker/registration.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <span>
#include <vector>

#include "core/parallel/arena.h"
#include "worker/registration/fit/deformation.h"
#include "worker/registration/fit/energy.h"
#include "worker/registration/fit/node_groups.h"

namespace liquidblend::registration {

// A x = rhs over x = [X | b] of all nodes, a 4 x 5 matrix each (20 unknowns, column by column).
// The arguments of the constructor must outlive it.
// Threads: one call at a time; same bytes for any thread count.  Memory: 16 bytes per term and
// influence.
class NormalEquations {
 public:
  NormalEquations(const DeformationNodes& nodes, const NodeGraph& graph, const Points& rest,
                  const std::vector<FitTerm>& terms, const SolverOptions& options,
                  const parallel::Arena& arena);

  int64_t num_nodes() const { return num_nodes_; }
  const NodeGraph& graph() const { return graph_; }
  // Per node: whether a term has a weight where the node has influence.
  std::vector<char> HeldNodes() const;
  void Multiply(const std::vector<NodeMap>& x, const parallel::Arena& arena,
                std::vector<NodeMap>& result) const;
  std::vector<NodeMap> RightHandSide(const parallel::Arena& arena) const;
  Eigen::Matrix<double, 20, 20> DiagonalBlock(int64_t node) const;
  Eigen::SparseMatrix<double> Assemble() const;
  // The normal equations of groups, with 20 unknowns per group, those of its map; the blocks above
  // the diagonal are left out, and of the damping all but its part on the centres' maps.
  Eigen::MatrixXd AssembleFor(const NodeGroups& groups, const parallel::Arena& arena) const;

  double FitEnergy(const std::vector<NodeMap>& x, const parallel::Arena& arena) const;
  double SmoothnessEnergy(const std::vector<NodeMap>& x, const parallel::Arena& arena) const;

 private:
  // A term that a node moves.
  struct Entry {
    int32_t term;
    float weight;
  };
  struct TermState {
    Eigen::Vector4f position;  // at rest
    Eigen::Vector4f force;     // a product's contribution to the term's nodes
  };

  std::span<const Influence> InfluencesOn(int64_t term) const {
    return {influences_.data() + term_begin_[term],
            static_cast<size_t>(term_begin_[term + 1] - term_begin_[term])};
  }
  std::span<const Entry> EntriesOf(int64_t node) const {
    return {entries_.data() + begin_[node], static_cast<size_t>(begin_[node + 1] - begin_[node])};
  }
  Eigen::Vector4f Displacement(int64_t term, const std::vector<NodeMap>& x) const;
  // weight * (v - n, 1)
  Eigen::Matrix<double, 5, 1> Coefficients(int64_t term, const Influence& influence) const;
  Eigen::Vector4f Prediction(const NodeGraph::Edge& edge, const std::vector<NodeMap>& x) const;
  using Vector5d = Eigen::Matrix<double, 5, 1>;
  // The influence of a group's map on a term.
  struct Seen {
    int32_t group;
    Vector5d coefficients;
  };
  // (point - centre of the node's group, 1)
  Vector5d FromCentre(const Eigen::Vector4f& point, int32_t node, const NodeGroups& groups) const;
  std::vector<Seen> GroupsOf(int64_t term, const NodeGroups& groups) const;
  void ListTermsOfNodes(const parallel::Arena& arena);
  // Sums the contributions of the terms onto the nodes; for a product with x also those of the
  // edges and the damping.
  //   x  null: the terms alone
  void Gather(const std::vector<NodeMap>* x, const parallel::Arena& arena,
              std::vector<NodeMap>& result) const;

  const DeformationNodes& nodes_;
  const NodeGraph& graph_;
  const std::vector<FitTerm>& terms_;
  int64_t num_nodes_;
  float fit_scale_;
  float smoothness_;
  float damping_;
  std::vector<int64_t> term_begin_;    // num_terms + 1
  std::vector<Influence> influences_;  // by term, then by node: next to one another, unlike nodes_'
  std::vector<int64_t> begin_;         // num_nodes + 1
  std::vector<Entry> entries_;         // by node, then by term
  mutable std::vector<TermState> states_;  // per term; forces are scratch of the products,
  mutable std::vector<Eigen::Vector4f> edge_forces_;  // and so are those of the edges
};

}  // namespace liquidblend::registration
