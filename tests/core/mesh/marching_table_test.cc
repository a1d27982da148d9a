#include "core/mesh/marching_table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>
#include <vector>

namespace liquidblend::mesh {
namespace {

using Edge = std::pair<int, int>;       // positions in a facet, the lower one first
using Segment = std::pair<Edge, Edge>;  // from, to
using Segments = std::set<Segment>;

// Calls visit(facets, table) for each cell kind.
template <typename Visit>
void ForEachKind(Visit&& visit) {
  visit(kTetrahedronFacets, kTetrahedronTable);
  visit(kPyramidFacets, kPyramidTable);
  visit(kWedgeFacets, kWedgeTable);
  visit(kHexahedronFacets, kHexahedronTable);
}

// The segments that a case's loops have in one facet, whose corners are given in any cyclic order.
template <typename Table>
Segments SegmentsIn(const Table& table, int code, const std::vector<int>& facet) {
  const auto position_of = [&](int corner) {
    const auto it = std::find(facet.begin(), facet.end(), corner);
    return it == facet.end() ? -1 : static_cast<int>(it - facet.begin());
  };
  const auto local = [&](int edge) {
    return Edge(std::minmax(position_of(table.edges[edge][0]), position_of(table.edges[edge][1])));
  };
  Segments segments;
  const Case& cut = table.cases[code];
  for (int loop = 0, begin = 0; loop < cut.num_loops; begin += cut.loop_size[loop++]) {
    for (int k = 0; k < cut.loop_size[loop]; ++k) {
      const Edge from = local(cut.edges[begin + k]);
      const Edge to = local(cut.edges[begin + (k + 1) % cut.loop_size[loop]]);
      if (from.first >= 0 && to.first >= 0) segments.emplace(from, to);
    }
  }
  return segments;
}

// Bit k: the corner at position k of the facet is later.
int SignsOf(int code, const std::vector<int>& facet) {
  int signs = 0;
  for (size_t k = 0; k < facet.size(); ++k) signs |= (code >> facet[k] & 1) << k;
  return signs;
}

// What the table of every kind, in every facet, turned into every position, with every sign of the
// cell's other corners, says about a facet of this size and these signs.
using SegmentsBySigns = std::map<std::pair<int, int>, std::set<Segments>>;

SegmentsBySigns CollectSegments() {
  SegmentsBySigns collected;
  ForEachKind([&](const auto& facets, const auto& table) {
    for (const Facet& facet : facets) {
      std::vector<int> corners(facet.corners.begin(), facet.corners.begin() + facet.num_corners);
      for (int turn = 0; turn < facet.num_corners; ++turn) {
        for (int code = 0; code < static_cast<int>(table.cases.size()); ++code) {
          collected[{facet.num_corners, SignsOf(code, corners)}].insert(
              SegmentsIn(table, code, corners));
        }
        std::rotate(corners.begin(), corners.begin() + 1, corners.end());
      }
    }
  });
  return collected;
}

TEST(MarchingTable, AFacetIsCutAlikeInEveryCell) {
  const SegmentsBySigns collected = CollectSegments();
  EXPECT_EQ(collected.size(), 8U + 16U);
  for (const auto& [size_and_signs, segments] : collected) {
    EXPECT_EQ(segments.size(), 1U)
        << "facet of " << size_and_signs.first << " corners, signs " << size_and_signs.second;
  }
}

TEST(MarchingTable, TheCellOnTheOtherSideRunsThroughTheSameSegmentsBackwards) {
  SegmentsBySigns collected = CollectSegments();
  ASSERT_EQ(collected.size(), 8U + 16U);
  for (const auto& [size_and_signs, segments] : collected) {
    const auto [size, signs] = size_and_signs;
    const int last = size - 1;  // the other cell goes round the corners backwards
    int mirrored_signs = 0;
    for (int k = 0; k < size; ++k) mirrored_signs |= (signs >> k & 1) << (last - k);
    const auto mirrored = [&](Edge e) { return Edge(last - e.second, last - e.first); };
    Segments expected;
    for (const auto& [from, to] : *collected[{size, mirrored_signs}].begin()) {
      expected.emplace(mirrored(to), mirrored(from));
    }
    EXPECT_EQ(*segments.begin(), expected) << "facet of " << size << ", signs " << signs;
  }
}

TEST(MarchingTable, AnAmbiguousQuadSeparatesItsLaterCorners) {
  const SegmentsBySigns collected = CollectSegments();
  const Segments around_0_and_2 = {{{0, 3}, {0, 1}}, {{1, 2}, {2, 3}}};
  const Segments around_1_and_3 = {{{0, 1}, {1, 2}}, {{2, 3}, {0, 3}}};
  EXPECT_EQ(*collected.at({4, 0b0101}).begin(), around_0_and_2);
  EXPECT_EQ(*collected.at({4, 0b1010}).begin(), around_1_and_3);
}

TEST(MarchingTable, EachCrossedEdgeLiesInOneLoopAndNoOtherEdgeInAny) {
  ForEachKind([](const auto&, const auto& table) {
    for (int code = 0; code < static_cast<int>(table.cases.size()); ++code) {
      std::vector<int> expected;
      for (int e = 0; e < table.num_edges; ++e) {
        if ((code >> table.edges[e][0] & 1) != (code >> table.edges[e][1] & 1)) {
          expected.push_back(e);
        }
      }
      const Case& cut = table.cases[code];
      std::vector<int> actual;
      for (int loop = 0; loop < cut.num_loops; ++loop) {
        EXPECT_GE(cut.loop_size[loop], 3);
        for (int k = 0; k < cut.loop_size[loop]; ++k) {
          actual.push_back(cut.edges[actual.size()]);
        }
      }
      std::sort(actual.begin(), actual.end());
      EXPECT_EQ(actual, expected) << "code " << code;
    }
  });
}

TEST(MarchingTable, KindsHaveTheirEdges) {
  EXPECT_EQ(kTetrahedronTable.num_edges, 6);
  EXPECT_EQ(kPyramidTable.num_edges, 8);
  EXPECT_EQ(kWedgeTable.num_edges, 9);
  EXPECT_EQ(kHexahedronTable.num_edges, 12);
}

}  // namespace
}  // namespace liquidblend::mesh
