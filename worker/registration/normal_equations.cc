#include "worker/registration/normal_equations.h"

#include <numeric>

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
    : graph_(graph),
      terms_(terms),
      num_nodes_(nodes.num_nodes()),
      fit_scale_(static_cast<float>(static_cast<double>(num_nodes_) /
                                    static_cast<double>(std::max<size_t>(1, terms.size())))),
      smoothness_(static_cast<float>(options.smoothness)),
      damping_(static_cast<float>(options.damping)) {
  const int64_t num_terms = static_cast<int64_t>(terms.size());
  node_of_.begin.assign(num_terms + 1, 0);
  for (int64_t s = 0; s < num_terms; ++s) {
    node_of_.begin[s + 1] =
        node_of_.begin[s] + static_cast<int64_t>(nodes.influences(terms[s].vertex).size());
  }
  node_of_.items.resize(node_of_.begin.back());
  coefficients_.resize(node_of_.begin.back());
  arena.For(num_terms, [&](int64_t s) {
    int64_t entry = node_of_.begin[s];
    for (const Influence& influence : nodes.influences(terms[s].vertex)) {
      const Eigen::Vector4f offset =
          influence.weight * (rest.col(terms[s].vertex) - nodes.position(influence.node));
      node_of_.items[entry] = influence.node;
      coefficients_[entry++] = {offset[0], offset[1], offset[2], offset[3], influence.weight};
    }
  });
  entries_of_.begin.assign(num_nodes_ + 1, 0);
  for (const int32_t node : node_of_.items) ++entries_of_.begin[node + 1];
  std::partial_sum(entries_of_.begin.begin(), entries_of_.begin.end(), entries_of_.begin.begin());
  entries_of_.items.resize(node_of_.items.size());
  term_of_.resize(node_of_.items.size());
  std::vector<int64_t> next(entries_of_.begin.begin(), entries_of_.begin.end() - 1);
  for (int64_t s = 0; s < num_terms; ++s) {
    for (int64_t entry = node_of_.begin[s]; entry < node_of_.begin[s + 1]; ++entry) {
      const int64_t slot = next[node_of_.items[entry]]++;
      entries_of_.items[slot] = static_cast<int32_t>(entry);
      term_of_[slot] = static_cast<int32_t>(s);
    }
  }
}

Eigen::Vector4f NormalEquations::Displacement(int64_t term, const std::vector<NodeMap>& x) const {
  Eigen::Vector4f u = Eigen::Vector4f::Zero();
  for (int64_t entry = node_of_.begin[term]; entry < node_of_.begin[term + 1]; ++entry) {
    const NodeMap& map = x[node_of_.items[entry]];
    const Coefficients& c = coefficients_[entry];
    for (int a = 0; a < 5; ++a) u += c[a] * map.col(a);
  }
  return u;
}

// How far the map of edge.from misses the displacement of node edge.to.
Eigen::Vector4f NormalEquations::Prediction(const NodeGraph::Edge& edge,
                                            const std::vector<NodeMap>& x) const {
  const NodeMap& from = x[edge.from];
  return from.leftCols<4>() * edge.offset + from.col(4) - x[edge.to].col(4);
}

void NormalEquations::Gather(const std::vector<Eigen::Vector4f>& of_term,
                             const std::vector<Eigen::Vector4f>& of_edge,
                             const parallel::Arena& arena, std::vector<NodeMap>& result) const {
  result.resize(num_nodes_);
  arena.For(
      num_nodes_,
      [&](int64_t n) {
        NodeMap sum = NodeMap::Zero();
        for (int64_t slot = entries_of_.begin[n]; slot < entries_of_.begin[n + 1]; ++slot) {
          const Coefficients& c = coefficients_[entries_of_.items[slot]];
          const Eigen::Vector4f& f = of_term[term_of_[slot]];
          for (int a = 0; a < 5; ++a) sum.col(a) += c[a] * f;
        }
        NodeMap smooth = NodeMap::Zero();
        if (!of_edge.empty()) {
          for (const int32_t e : graph_.leaving()[n]) {
            smooth += of_edge[e] * EdgeCoefficients(graph_.edges()[e]).transpose();
          }
          for (const int32_t e : graph_.arriving()[n]) smooth.col(4) -= of_edge[e];
        }
        result[n] = fit_scale_ * sum + smoothness_ * smooth;
      },
      16);
}

void NormalEquations::Multiply(const std::vector<NodeMap>& x, const parallel::Arena& arena,
                               std::vector<NodeMap>& result) const {
  std::vector<Eigen::Vector4f> of_term(terms_.size()), of_edge(graph_.edges().size());
  arena.For(static_cast<int64_t>(terms_.size()),
            [&](int64_t s) { of_term[s] = terms_[s].metric * Displacement(s, x); });
  arena.For(static_cast<int64_t>(of_edge.size()), [&](int64_t e) {
    of_edge[e] = graph_.edges()[e].weight * Prediction(graph_.edges()[e], x);
  });
  Gather(of_term, of_edge, arena, result);
  for (int64_t n = 0; n < num_nodes_; ++n) result[n] += damping_ * x[n];
}

std::vector<NodeMap> NormalEquations::RightHandSide(const parallel::Arena& arena) const {
  std::vector<Eigen::Vector4f> of_term(terms_.size());
  arena.For(static_cast<int64_t>(terms_.size()),
            [&](int64_t s) { of_term[s] = terms_[s].metric * terms_[s].goal; });
  std::vector<NodeMap> result;
  Gather(of_term, {}, arena, result);
  return result;
}

Eigen::Matrix<double, 20, 20> NormalEquations::DiagonalBlock(int64_t node) const {
  // Symmetric, so only the upper parts of c c^T (15) and of the metric (10) are summed.
  std::array<std::array<float, 10>, 15> sum{};
  for (int64_t slot = entries_of_.begin[node]; slot < entries_of_.begin[node + 1]; ++slot) {
    const Coefficients& c = coefficients_[entries_of_.items[slot]];
    const Eigen::Matrix4f& m = terms_[term_of_[slot]].metric;
    const std::array<float, 10> upper = {m(0, 0), m(0, 1), m(0, 2), m(0, 3), m(1, 1),
                                         m(1, 2), m(1, 3), m(2, 2), m(2, 3), m(3, 3)};
    for (int a = 0, ab = 0; a < 5; ++a) {
      for (int b = a; b < 5; ++b, ++ab) {
        const float cc = c[a] * c[b];
        for (int k = 0; k < 10; ++k) sum[ab][k] += cc * upper[k];
      }
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
  for (size_t s = 0; s < terms_.size(); ++s) {
    const Eigen::Matrix4d metric = fit_scale_ * terms_[s].metric.cast<double>();
    for (int64_t e = node_of_.begin[s]; e < node_of_.begin[s + 1]; ++e) {
      const Vector5f c = Eigen::Map<const Vector5f>(coefficients_[e].data());
      for (int64_t f = node_of_.begin[s]; f <= e; ++f) {
        const Vector5f d = Eigen::Map<const Vector5f>(coefficients_[f].data());
        AddKronecker(c.cast<double>() * d.cast<double>().transpose(), metric,
                     at(node_of_.items[e], node_of_.items[f]));
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
