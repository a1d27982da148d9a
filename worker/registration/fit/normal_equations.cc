#include "worker/registration/fit/normal_equations.h"

#include <algorithm>
#include <utility>

namespace liquidblend::registration {
namespace {

using Vector5f = Eigen::Matrix<float, 5, 1>;

Vector5f EdgeCoefficients(const NodeGraph::Edge& edge) {
  Vector5f c;
  c << edge.offset, 1.0f;
  return c;
}

// (c c^T) (x) m: the 20 x 20 block that a term adds at a node, unknowns column by column.
template <typename Metric>
void AddKronecker(const Eigen::Matrix<double, 5, 5>& cc, const Metric& m,
                  Eigen::Matrix<double, 20, 20>& block) {
  for (int a = 0; a < 5; ++a) {
    for (int b = 0; b < 5; ++b) block.block<4, 4>(4 * a, 4 * b) += cc(a, b) * m;
  }
}

}  // namespace

NormalEquations::NormalEquations(const DeformationNodes& nodes, const NodeGraph& graph,
                                 const Points& rest, const std::vector<FitTerm>& terms,
                                 const SolverOptions& options, const parallel::Arena& arena)
    : nodes_(nodes),
      graph_(graph),
      terms_(terms),
      num_nodes_(nodes.num_nodes()),
      fit_scale_(static_cast<float>(static_cast<double>(num_nodes_) /
                                    static_cast<double>(std::max<size_t>(1, terms.size())))),
      smoothness_(static_cast<float>(options.smoothness)),
      damping_(static_cast<float>(options.damping)),
      begin_(num_nodes_ + 1, 0),
      edge_forces_(graph.edges().size()) {
  const auto num_terms = static_cast<int64_t>(terms.size());
  term_begin_.reserve(terms.size() + 1);
  term_begin_.push_back(0);
  for (const FitTerm& term : terms) {
    const auto count = static_cast<int64_t>(nodes.influences(term.vertex).size());
    term_begin_.push_back(term_begin_.back() + count);
  }
  states_.resize(terms.size());
  influences_.resize(term_begin_.back());
  arena.For(num_terms, [&](int64_t s) {
    states_[s] = {rest.col(terms[s].vertex), Eigen::Vector4f::Zero()};
    int64_t next = term_begin_[s];
    for (const Influence& influence : nodes.influences(terms[s].vertex)) {
      influences_[next++] = influence;
    }
  });
  ListTermsOfNodes(arena);
}

// A counting sort, in chunks of terms: first how many entries each node has in each, then where
// those of a chunk begin, then the entries.
void NormalEquations::ListTermsOfNodes(const parallel::Arena& arena) {
  constexpr int64_t kNumChunks = 8;
  const auto num_terms = static_cast<int64_t>(terms_.size());
  const int64_t chunk_size = num_terms / kNumChunks + 1;
  std::vector<std::vector<int64_t>> next(kNumChunks, std::vector<int64_t>(num_nodes_, 0));
  arena.ForChunks(num_terms, chunk_size, [&](int64_t chunk, int64_t first, int64_t last) {
    for (int64_t e = term_begin_[first]; e < term_begin_[last]; ++e) {
      ++next[chunk][influences_[e].node];
    }
  });
  for (int64_t n = 0; n < num_nodes_; ++n) {
    begin_[n + 1] = begin_[n];
    for (std::vector<int64_t>& of_chunk : next) {
      begin_[n + 1] += std::exchange(of_chunk[n], begin_[n + 1]);
    }
  }
  entries_.resize(term_begin_.back());
  arena.ForChunks(num_terms, chunk_size, [&](int64_t chunk, int64_t first, int64_t last) {
    for (int64_t s = first; s < last; ++s) {
      for (const Influence& influence : InfluencesOn(s)) {
        entries_[next[chunk][influence.node]++] = {static_cast<int32_t>(s), influence.weight};
      }
    }
  });
}

Eigen::Vector4f NormalEquations::Displacement(int64_t term, const std::vector<NodeMap>& x) const {
  Eigen::Vector4f sum = Eigen::Vector4f::Zero();
  const Eigen::Vector4f position = states_[term].position;
  for (const Influence& influence : InfluencesOn(term)) {
    const NodeMap& map = x[influence.node];
    const Eigen::Vector4f offset = influence.weight * (position - nodes_.position(influence.node));
    for (int a = 0; a < 4; ++a) sum += offset[a] * map.col(a);
    sum += influence.weight * map.col(4);
  }
  return sum;
}

Eigen::Matrix<double, 5, 1> NormalEquations::Coefficients(int64_t term,
                                                          const Influence& influence) const {
  Eigen::Matrix<double, 5, 1> c;
  c << (states_[term].position - nodes_.position(influence.node)).cast<double>(), 1.0;
  return influence.weight * c;
}

// How far the map of edge.from misses the displacement of node edge.to.
Eigen::Vector4f NormalEquations::Prediction(const NodeGraph::Edge& edge,
                                            const std::vector<NodeMap>& x) const {
  const NodeMap& from = x[edge.from];
  return from.leftCols<4>() * edge.offset + from.col(4) - x[edge.to].col(4);
}

void NormalEquations::Gather(const std::vector<NodeMap>* x, const parallel::Arena& arena,
                             std::vector<NodeMap>& result) const {
  result.resize(num_nodes_);
  arena.For(
      num_nodes_,
      [&](int64_t n) {
        const Eigen::Vector4f position = nodes_.position(n);
        NodeMap sum = NodeMap::Zero();
        for (const Entry& entry : EntriesOf(n)) {
          const TermState& term = states_[entry.term];
          const Eigen::Vector4f f = entry.weight * term.force;
          const Eigen::Vector4f offset = term.position - position;
          for (int a = 0; a < 4; ++a) sum.col(a) += offset[a] * f;
          sum.col(4) += f;
        }
        NodeMap smooth = NodeMap::Zero();
        if (x != nullptr) {
          for (const int32_t e : graph_.leaving()[n]) {
            smooth += edge_forces_[e] * EdgeCoefficients(graph_.edges()[e]).transpose();
          }
          for (const int32_t e : graph_.arriving()[n]) smooth.col(4) -= edge_forces_[e];
        }
        result[n] = fit_scale_ * sum + smoothness_ * smooth;
        if (x != nullptr) result[n] += damping_ * (*x)[n];
      },
      16);
}

void NormalEquations::Multiply(const std::vector<NodeMap>& x, const parallel::Arena& arena,
                               std::vector<NodeMap>& result) const {
  arena.For(static_cast<int64_t>(states_.size()),
            [&](int64_t s) { states_[s].force = terms_[s].metric * Displacement(s, x); });
  arena.For(static_cast<int64_t>(edge_forces_.size()), [&](int64_t e) {
    edge_forces_[e] = graph_.edges()[e].weight * Prediction(graph_.edges()[e], x);
  });
  Gather(&x, arena, result);
}

std::vector<NodeMap> NormalEquations::RightHandSide(const parallel::Arena& arena) const {
  arena.For(static_cast<int64_t>(states_.size()),
            [&](int64_t s) { states_[s].force = terms_[s].metric * terms_[s].goal; });
  std::vector<NodeMap> result;
  Gather(nullptr, arena, result);
  return result;
}

Eigen::Matrix<double, 20, 20> NormalEquations::DiagonalBlock(int64_t node) const {
  // Symmetric, so only the upper parts of c c^T (15) and of the metric (10, filled up to 12) are
  // summed.
  using Upper = Eigen::Array<float, 12, 1>;
  std::array<Upper, 15> sum;
  sum.fill(Upper::Zero());
  const Eigen::Vector4f position = nodes_.position(node);
  for (const Entry& entry : EntriesOf(node)) {
    const FitTerm& term = terms_[entry.term];
    const Eigen::Vector4f offset = entry.weight * (states_[entry.term].position - position);
    const Vector5f c = (Vector5f() << offset, entry.weight).finished();
    const Eigen::Matrix4f& m = term.metric;
    const Upper upper = (Upper() << m(0, 0), m(0, 1), m(0, 2), m(0, 3), m(1, 1), m(1, 2), m(1, 3),
                         m(2, 2), m(2, 3), m(3, 3), 0, 0)
                            .finished();
    for (int a = 0, ab = 0; a < 5; ++a) {
      for (int b = a; b < 5; ++b, ++ab) sum[ab] += c[a] * c[b] * upper;
    }
  }
  Eigen::Matrix<double, 20, 20> block = damping_ * Eigen::Matrix<double, 20, 20>::Identity();
  for (int a = 0, ab = 0; a < 5; ++a) {
    for (int b = a; b < 5; ++b, ++ab) {
      Eigen::Matrix4d m;
      for (int r = 0, k = 0; r < 4; ++r) {
        for (int s = r; s < 4; ++s, ++k) m(r, s) = m(s, r) = fit_scale_ * sum[ab][k];
      }
      block.block<4, 4>(4 * a, 4 * b) += m;
      if (a != b) block.block<4, 4>(4 * b, 4 * a) += m;
    }
  }
  for (const int32_t e : graph_.leaving()[node]) {
    const NodeGraph::Edge& edge = graph_.edges()[e];
    const Eigen::Matrix<double, 5, 1> c = EdgeCoefficients(edge).cast<double>();
    AddKronecker(smoothness_ * edge.weight * c * c.transpose(), Eigen::Matrix4d::Identity(), block);
  }
  for (const int32_t e : graph_.arriving()[node]) {
    block.bottomRightCorner<4, 4>().diagonal().array() += smoothness_ * graph_.edges()[e].weight;
  }
  return block;
}

Eigen::SparseMatrix<double> NormalEquations::Assemble() const {
  using Block = Eigen::Matrix<double, 20, 20>;
  std::vector<std::vector<std::pair<int32_t, Block>>> rows(
      num_nodes_);  // blocks on and below diagonal
  const auto at = [&](int32_t row, int32_t col) -> Block& {
    for (auto& [c, block] : rows[row]) {
      if (c == col) return block;
    }
    rows[row].emplace_back(col, Block::Zero());
    return rows[row].back().second;
  };
  for (int64_t s = 0; s < static_cast<int64_t>(terms_.size()); ++s) {
    const Eigen::Matrix4d metric = fit_scale_ * terms_[s].metric.cast<double>();
    const auto influences = InfluencesOn(s);
    for (size_t e = 0; e < influences.size(); ++e) {
      const Eigen::Matrix<double, 5, 1> c = Coefficients(s, influences[e]);
      for (size_t f = 0; f <= e; ++f) {
        const Eigen::Matrix<double, 5, 1> d = Coefficients(s, influences[f]);
        AddKronecker(c * d.transpose(), metric, at(influences[e].node, influences[f].node));
      }
    }
  }
  for (const NodeGraph::Edge& edge : graph_.edges()) {
    const Eigen::Matrix<double, 5, 1> c = EdgeCoefficients(edge).cast<double>();
    Eigen::Matrix<double, 5, 1> only_b = Eigen::Matrix<double, 5, 1>::Zero();
    only_b[4] = -1;
    const double weight = smoothness_ * edge.weight;
    const Eigen::Matrix4d identity = Eigen::Matrix4d::Identity();
    AddKronecker(weight * c * c.transpose(), identity, at(edge.from, edge.from));
    AddKronecker(weight * only_b * only_b.transpose(), identity, at(edge.to, edge.to));
    if (edge.from > edge.to) {
      AddKronecker(weight * c * only_b.transpose(), identity, at(edge.from, edge.to));
    } else {
      AddKronecker(weight * only_b * c.transpose(), identity, at(edge.to, edge.from));
    }
  }
  std::vector<Eigen::Triplet<double>> triplets;
  for (int32_t row = 0; row < num_nodes_; ++row) {
    at(row, row).diagonal().array() += damping_;
    for (const auto& [col, block] : rows[row]) {
      for (int c = 0; c < 20; ++c) {
        for (int r = 0; r < 20; ++r) {
          if (row != col || r >= c) triplets.emplace_back(20 * row + r, 20 * col + c, block(r, c));
        }
      }
    }
  }
  Eigen::SparseMatrix<double> matrix(20 * num_nodes_, 20 * num_nodes_);
  matrix.setFromTriplets(triplets.begin(), triplets.end());
  return matrix;
}

// A node's map is its group's after a shift by the node's offset from the centre. So a term sees
// each group as a node at the centre with the sum of the weights, and an edge within a group
// sees nothing.
NormalEquations::Vector5d NormalEquations::FromCentre(const Eigen::Vector4f& point, int32_t node,
                                                      const NodeGroups& groups) const {
  Vector5d c;
  c << (point - nodes_.position(node) + groups.offset.col(node)).cast<double>(), 1.0;
  return c;
}

std::vector<NormalEquations::Seen> NormalEquations::GroupsOf(int64_t term,
                                                             const NodeGroups& groups) const {
  std::vector<Seen> all;
  for (const Influence& influence : InfluencesOn(term)) {
    const int32_t group = groups.of_node[influence.node];
    if (group < 0) continue;
    auto seen = std::find_if(all.begin(), all.end(),
                             [&](const Seen& other) { return other.group == group; });
    if (seen == all.end()) seen = all.insert(all.end(), {group, Vector5d::Zero()});
    seen->coefficients +=
        influence.weight * FromCentre(states_[term].position, influence.node, groups);
  }
  return all;
}

std::vector<char> NormalEquations::HeldNodes() const {
  std::vector<char> is_held(num_nodes(), 0);
  for (int64_t s = 0; s < static_cast<int64_t>(terms_.size()); ++s) {
    if (!(terms_[s].metric.trace() > 0)) continue;
    for (const Influence& influence : InfluencesOn(s)) is_held[influence.node] = 1;
  }
  return is_held;
}

Eigen::MatrixXd NormalEquations::AssembleFor(const NodeGroups& groups,
                                             const parallel::Arena& arena) const {
  constexpr int64_t kNumChunks = 4;
  const int64_t num_terms = static_cast<int64_t>(terms_.size()), size = 20 * groups.size();
  std::vector<Eigen::MatrixXd> sums(kNumChunks, Eigen::MatrixXd::Zero(size, size));
  const auto add = [](const std::vector<Seen>& all, const Eigen::Matrix4d& metric,
                      Eigen::MatrixXd& sum) {
    for (const auto& [row, c] : all) {
      for (const auto& [col, d] : all) {
        if (row < col) continue;
        for (int ab = 0; ab < 25; ++ab) {
          sum.block<4, 4>(20 * row + 4 * (ab / 5), 20 * col + 4 * (ab % 5)) +=
              c[ab / 5] * d[ab % 5] * metric;
        }
      }
    }
  };
  arena.ForChunks(
      num_terms, num_terms / kNumChunks + 1, [&](int64_t k, int64_t begin, int64_t end) {
        for (int64_t s = begin; s < end; ++s) {
          add(GroupsOf(s, groups), fit_scale_ * terms_[s].metric.cast<double>(), sums[k]);
        }
      });
  for (int64_t k = 1; k < kNumChunks; ++k) sums[0] += sums[k];
  for (const NodeGraph::Edge& edge : graph_.edges()) {
    const int32_t from = groups.of_node[edge.from], to = groups.of_node[edge.to];
    if (from == to || from < 0 || to < 0) continue;
    const Eigen::Vector4f end = nodes_.position(edge.to);
    add({{from, FromCentre(end, edge.from, groups)}, {to, -FromCentre(end, edge.to, groups)}},
        smoothness_ * edge.weight * Eigen::Matrix4d::Identity(), sums[0]);
  }
  for (int64_t c = 0; c < groups.size(); ++c) {
    sums[0].diagonal().segment<20>(20 * c).array() +=
        damping_ * static_cast<float>(groups.nodes[c].size());
  }
  return sums[0];
}

double NormalEquations::FitEnergy(const std::vector<NodeMap>& x,
                                  const parallel::Arena& arena) const {
  return fit_scale_ * arena.Sum(static_cast<int64_t>(terms_.size()), [&](int64_t s) {
    const Eigen::Vector4f miss = Displacement(s, x) - terms_[s].goal;
    return static_cast<double>(miss.dot(terms_[s].metric * miss));
  });
}

double NormalEquations::SmoothnessEnergy(const std::vector<NodeMap>& x,
                                         const parallel::Arena& arena) const {
  return arena.Sum(static_cast<int64_t>(graph_.edges().size()), [&](int64_t e) {
    const NodeGraph::Edge& edge = graph_.edges()[e];
    return static_cast<double>(edge.weight * Prediction(edge, x).squaredNorm());
  });
}

}  // namespace liquidblend::registration
