#include "core/slice/cell_index.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "core/blend/blend.h"
#include "core/mesh/marching_table.h"
#include "tests/synthetic/families.h"

namespace liquidblend::slice {
namespace {

using Edge = std::pair<int32_t, int32_t>;

mesh::RegisteredFamily MixedFamily() {
  return synthetic::MakeFamily(synthetic::MixedSphere(8), {{synthetic::SmoothWarp(1, 0.5F, 4.0F),
                                                            synthetic::SmoothWarp(2, 0.3F, 2.0F)},
                                                           {synthetic::Noise(3, 0.3F, 3.0F), {}}});
}

// Calls visit(kind's number of corners, its edges) with the table of the cluster's kind.
template <typename Visit>
void WithTable(CellKind kind, Visit&& visit) {
  switch (kind) {
    case CellKind::kTetrahedron:
      return visit(4, mesh::kTetrahedronTable);
    case CellKind::kPyramid:
      return visit(5, mesh::kPyramidTable);
    case CellKind::kWedge:
      return visit(6, mesh::kWedgeTable);
    case CellKind::kHexahedron:
      return visit(8, mesh::kHexahedronTable);
  }
}

// The vertices of each edge number of a cluster; an edge has the same ones in all of its cells.
std::map<int, Edge> EdgesOf(const Cluster& cluster) {
  std::map<int, Edge> edges;
  WithTable(cluster.kind, [&](int, const auto& table) {
    for (int c = 0; c < cluster.num_cells; ++c) {
      for (int e = 0; e < table.num_edges; ++e) {
        const auto vertex = [&](int end) {
          return cluster.vertices[cluster.corners[table.edges[e][end] * cluster.num_cells + c]];
        };
        const Edge edge = std::minmax({vertex(0), vertex(1)});
        const int number = cluster.edges[c * table.num_edges + e];
        EXPECT_EQ(edges.emplace(number, edge).first->second, edge);
      }
    }
  });
  return edges;
}

TEST(CellIndex, HasEachCellOnceInClustersOfLimitedSize) {
  const mesh::RegisteredFamily family = MixedFamily();
  const CellIndex index(family);
  std::multiset<std::vector<int32_t>> expected;
  const auto add = [&](const auto& cells) {
    for (const auto& cell : cells) expected.emplace(cell.begin(), cell.end());
  };
  add(family.tetrahedra);
  add(family.pyramids);
  add(family.wedges);
  add(family.hexahedra);
  std::multiset<std::vector<int32_t>> actual;
  for (int32_t n = 0; n < index.num_clusters(); ++n) {
    const Cluster cluster = index.cluster(n);
    EXPECT_LE(cluster.num_cells, kMaxClusterCells);
    EXPECT_LE(cluster.vertices.size(), kMaxClusterVertices);
    EXPECT_LE(cluster.num_edges, kMaxClusterEdges);
    EXPECT_TRUE(std::is_sorted(cluster.vertices.begin(), cluster.vertices.end()));
    WithTable(cluster.kind, [&](int num_corners, const auto&) {
      for (int c = 0; c < cluster.num_cells; ++c) {
        std::vector<int32_t> cell;
        for (int k = 0; k < num_corners; ++k) {
          cell.push_back(cluster.vertices[cluster.corners[k * cluster.num_cells + c]]);
        }
        actual.insert(cell);
      }
    });
  }
  EXPECT_EQ(actual, expected);
}

TEST(CellIndex, AnEdgeBelongsToTheFirstClusterThatHasIt) {
  const mesh::RegisteredFamily family = MixedFamily();
  const CellIndex index(family);
  std::map<Edge, std::pair<int32_t, int>> owners;
  int num_shared = 0;
  for (int32_t n = 0; n < index.num_clusters(); ++n) {
    const Cluster cluster = index.cluster(n);
    const std::map<int, Edge> edges = EdgesOf(cluster);
    ASSERT_EQ(std::ssize(edges), cluster.num_edges);
    for (const auto& [number, edge] : edges) {
      const auto [owner, is_new] = owners.emplace(edge, std::pair(n, number));
      EXPECT_EQ(is_new, number < cluster.num_own_edges);
      if (is_new) continue;
      const int shared = number - cluster.num_own_edges;
      EXPECT_EQ(owner->second,
                std::pair(cluster.owner_clusters[shared], int{cluster.owner_edges[shared]}));
      ++num_shared;
    }
  }
  EXPECT_GT(num_shared, 1000);
}

TEST(CellIndex, BoundsHoldTheTimesOfAllVerticesAtAnyWeights) {
  const mesh::RegisteredFamily family = MixedFamily();
  const CellIndex index(family);
  for (const auto& weights :
       std::vector<std::vector<double>>{{0, 0}, {0.5, -1}, {1, 1}, {2, 0.3}, {-1, 2}}) {
    std::vector<TimeTerm> terms;
    index.AppendTerms(weights, terms);
    const blend::Blender blender(family, weights);
    for (int32_t n = 0; n < index.num_clusters(); ++n) {
      const auto bounds_of = [&](std::span<const TimeRanges> times, int32_t i) {
        float low = times[0].min[i];
        float high = times[0].max[i];
        for (const TimeTerm& term : terms) {
          const TimeRanges& range = times[term.field];
          low += term.factor * (term.factor > 0 ? range.min : range.max)[i];
          high += term.factor * (term.factor > 0 ? range.max : range.min)[i];
        }
        return std::pair(low, high);
      };
      const Cluster cluster = index.cluster(n);
      std::vector<mesh::Float4> positions(cluster.vertices.size());
      blender.Place(cluster.vertices, positions.data());
      for (const auto& [low, high] : {bounds_of(index.cluster_times(), n),
                                      bounds_of(index.group_times(), n / kClustersPerGroup)}) {
        for (const mesh::Float4& position : positions) {
          EXPECT_GE(position[3], low - 1e-4F);
          EXPECT_LE(position[3], high + 1e-4F);
        }
      }
    }
  }
}

}  // namespace
}  // namespace liquidblend::slice
