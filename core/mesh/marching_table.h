// The cases of marching cells: for each cell kind and each set of later corners, the loops in which
// the hyperplane cuts the cell. All four tables come from one generator and the kinds' facets.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace liquidblend::mesh {

inline constexpr int kMaxEdges = 12;  // of a cell
inline constexpr int kMaxLoops = 4;   // of a case

// Corners of one facet, counter-clockwise seen from outside of the cell in the right-handed frame
// of its edges e1, e2, e3 (space_time_mesh.h).
struct Facet {
  int num_corners;
  std::array<int8_t, 4> corners;
};

// Facets of each cell kind.
inline constexpr std::array<Facet, 4> kTetrahedronFacets = {
    {{3, {0, 2, 1}}, {3, {0, 1, 3}}, {3, {0, 3, 2}}, {3, {1, 2, 3}}}};
inline constexpr std::array<Facet, 5> kPyramidFacets = {
    {{4, {0, 3, 2, 1}}, {3, {0, 1, 4}}, {3, {1, 2, 4}}, {3, {2, 3, 4}}, {3, {3, 0, 4}}}};
inline constexpr std::array<Facet, 5> kWedgeFacets = {
    {{3, {0, 2, 1}}, {3, {3, 4, 5}}, {4, {0, 1, 4, 3}}, {4, {1, 2, 5, 4}}, {4, {2, 0, 3, 5}}}};
inline constexpr std::array<Facet, 6> kHexahedronFacets = {{{4, {0, 2, 3, 1}},
                                                            {4, {4, 5, 7, 6}},
                                                            {4, {0, 1, 5, 4}},
                                                            {4, {2, 6, 7, 3}},
                                                            {4, {0, 4, 6, 2}},
                                                            {4, {1, 3, 7, 5}}}};

// Case of a marching table: closed polygons of crossed edges, counter-clockwise seen from outside
// of the liquid.
struct Case {
  int8_t num_loops = 0;
  int8_t num_edges = 0;  // of all loops
  std::array<int8_t, kMaxLoops> loop_size = {};
  std::array<int8_t, kMaxEdges> edges = {};  // of all loops, one loop after the other
};

// Marching table of a cell kind with kCorners corners: its edges, and the case of each set of later
// corners.
template <int kCorners>
struct MarchingTable {
  int num_edges = 0;
  std::array<std::array<int8_t, 2>, kMaxEdges> edges = {};  // corners, the lower one first
  std::array<uint16_t, kMaxEdges> facet_mates = {};  // bit set of the edges that share a facet
  std::array<Case, 1 << kCorners> cases = {};        // bit c of the index: corner c is later
};

namespace internal {

template <int kCorners>
constexpr int EdgeOf(const MarchingTable<kCorners>& table, int8_t a, int8_t b) {
  for (int e = 0; e < table.num_edges; ++e) {
    if (table.edges[e][0] == (a < b ? a : b) && table.edges[e][1] == (a < b ? b : a)) return e;
  }
  return -1;
}

template <int kCorners, std::size_t kFacets>
constexpr void AddEdges(const std::array<Facet, kFacets>& facets, MarchingTable<kCorners>& table) {
  for (const Facet& facet : facets) {
    uint16_t facet_edges = 0;
    for (int k = 0; k < facet.num_corners; ++k) {
      const int8_t a = facet.corners[k];
      const int8_t b = facet.corners[(k + 1) % facet.num_corners];
      if (EdgeOf(table, a, b) < 0) {
        table.edges[table.num_edges++] = {a < b ? a : b, a < b ? b : a};
      }
      facet_edges = static_cast<uint16_t>(facet_edges | 1 << EdgeOf(table, a, b));
    }
    for (int e = 0; e < table.num_edges; ++e) {
      if (facet_edges >> e & 1) {
        table.facet_mates[e] = static_cast<uint16_t>(table.facet_mates[e] | facet_edges);
      }
    }
  }
}

// Going round a facet, each run of later corners is cut off by a segment from the edge before the
// run to the edge after it. Where the signs of a quad alternate this separates the later corners;
// the cell on the other side goes round the other way and finds the same segments reversed.
template <int kCorners>
constexpr void AddSegments(const MarchingTable<kCorners>& table, const Facet& facet, int code,
                           std::array<int8_t, kMaxEdges>& next) {
  const int n = facet.num_corners;
  const auto is_later = [&](int k) { return (code >> facet.corners[k % n] & 1) != 0; };
  const auto edge_from = [&](int k) {
    return EdgeOf(table, facet.corners[k % n], facet.corners[(k + 1) % n]);
  };
  for (int k = 0; k < n; ++k) {
    if (is_later(k) || !is_later(k + 1)) continue;
    int last = k + 1;
    while (is_later(last + 1)) ++last;
    next[edge_from(k)] = static_cast<int8_t>(edge_from(last));
  }
}

// Each crossed edge lies in two facets, begins a segment in one and ends one in the other; so the
// segments link up into loops.
constexpr Case LinkLoops(const std::array<int8_t, kMaxEdges>& next) {
  Case result;
  std::array<bool, kMaxEdges> done = {};
  int num_edges = 0;
  for (int first = 0; first < kMaxEdges; ++first) {
    if (next[first] < 0 || done[first]) continue;
    const int begin = num_edges;
    for (int e = first; !done[e]; e = next[e]) {
      done[e] = true;
      result.edges[num_edges++] = static_cast<int8_t>(e);
    }
    result.loop_size[result.num_loops++] = static_cast<int8_t>(num_edges - begin);
  }
  result.num_edges = static_cast<int8_t>(num_edges);
  return result;
}

}  // namespace internal

// Makes the table of a cell kind from its facets, at compile time.
template <int kCorners, std::size_t kFacets>
constexpr MarchingTable<kCorners> MakeMarchingTable(const std::array<Facet, kFacets>& facets) {
  MarchingTable<kCorners> table;
  internal::AddEdges(facets, table);
  for (int code = 0; code < 1 << kCorners; ++code) {
    std::array<int8_t, kMaxEdges> next;
    next.fill(-1);
    for (const Facet& facet : facets) internal::AddSegments(table, facet, code, next);
    table.cases[code] = internal::LinkLoops(next);
  }
  return table;
}

// The tables of the four cell kinds.
inline constexpr MarchingTable<4> kTetrahedronTable = MakeMarchingTable<4>(kTetrahedronFacets);
inline constexpr MarchingTable<5> kPyramidTable = MakeMarchingTable<5>(kPyramidFacets);
inline constexpr MarchingTable<6> kWedgeTable = MakeMarchingTable<6>(kWedgeFacets);
inline constexpr MarchingTable<8> kHexahedronTable = MakeMarchingTable<8>(kHexahedronFacets);

}  // namespace liquidblend::mesh
