#include "worker/spacetime/tracked/track_cells.h"

#include <algorithm>
#include <utility>

#include "core/mesh/union_find.h"
#include "worker/spacetime/field/frame_topology.h"

namespace liquidblend::spacetime {
namespace {

constexpr int32_t kNoMatch = -1;

// A directed side of a matched triangle.
struct SideEdge {
  int32_t low, high;
  int direction;  // +1 from low to high
  bool operator<(const SideEdge& other) const {
    return std::pair(low, high) < std::pair(other.low, other.high);
  }
};

// The sides of wedges that no other wedge has.
void AddSides(const FramePair& pair, const FrameLinks& links, std::vector<Facet>& facets) {
  std::vector<SideEdge> edges;
  edges.reserve(3 * links.num_matched);
  for (int64_t t = 0; t < pair.earlier->num_triangles(); ++t) {
    if (links.triangle[t] < 0) continue;
    const Corners c = CornersOf(*pair.earlier, t);
    for (int k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(c[k], c[(k + 1) % 3]);
      edges.push_back({low, high, c[k] == low ? 1 : -1});
    }
  }
  std::sort(edges.begin(), edges.end());
  for (size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
    int sum = 0;
    for (end = begin; end < edges.size() && !(edges[begin] < edges[end]); ++end) {
      sum += edges[end].direction;
    }
    const int32_t from = sum > 0 ? edges[begin].low : edges[begin].high;
    const int32_t to = sum > 0 ? edges[begin].high : edges[begin].low;
    const Facet side = {
        {from, to, pair.num_earlier() + links.vertex[to], pair.num_earlier() + links.vertex[from]}};
    for (int n = std::abs(sum); n > 0; --n) facets.push_back(side);
  }
}

// The earlier frame's triangles as they are, the later one's turned round.
void AddUnmatched(const FramePair& pair, const FrameLinks& links, std::vector<Facet>& facets) {
  std::vector<uint8_t> is_met(pair.later->num_triangles(), 0);
  for (int64_t t = 0; t < pair.earlier->num_triangles(); ++t) {
    if (links.triangle[t] >= 0) {
      is_met[links.triangle[t]] = 1;
      continue;
    }
    const Corners c = CornersOf(*pair.earlier, t);
    if (!IsDegenerate(c)) facets.push_back({{c[0], c[1], c[2], kNoMatch}});
  }
  const int32_t first = pair.num_earlier();
  for (int64_t t = 0; t < pair.later->num_triangles(); ++t) {
    const Corners c = CornersOf(*pair.later, t);
    if (is_met[t] || IsDegenerate(c)) continue;
    facets.push_back({{first + c[0], first + c[2], first + c[1], kNoMatch}});
  }
}

}  // namespace

void AddWedges(const FramePair& pair, const FrameLinks& links, PairCells& cells) {
  const int32_t first = pair.num_earlier();
  cells.wedges.reserve(links.num_matched);
  for (int64_t t = 0; t < pair.earlier->num_triangles(); ++t) {
    if (links.triangle[t] < 0) continue;
    const Corners c = CornersOf(*pair.earlier, t);
    cells.wedges.push_back({c[0], c[2], c[1], first + links.vertex[c[0]],
                            first + links.vertex[c[2]], first + links.vertex[c[1]]});
  }
}

std::vector<std::vector<Facet>> FindPatches(const FramePair& pair, const FrameLinks& links) {
  std::vector<Facet> facets;
  AddUnmatched(pair, links, facets);
  AddSides(pair, links, facets);
  return SplitIntoParts(facets);
}

std::vector<std::vector<Facet>> SplitIntoParts(const std::vector<Facet>& facets) {
  struct EdgeOf {
    std::pair<int32_t, int32_t> edge;
    int32_t facet;
  };
  std::vector<EdgeOf> edges;
  edges.reserve(4 * facets.size());
  for (size_t f = 0; f < facets.size(); ++f) {
    for (int k = 0; k < facets[f].size(); ++k) {
      edges.push_back({std::minmax<int32_t>(
                           {facets[f].corners[k], facets[f].corners[(k + 1) % facets[f].size()]}),
                       static_cast<int32_t>(f)});
    }
  }
  std::sort(edges.begin(), edges.end(),
            [](const EdgeOf& a, const EdgeOf& b) { return a.edge < b.edge; });
  mesh::UnionFind sets(static_cast<int64_t>(facets.size()));
  for (size_t e = 1; e < edges.size(); ++e) {
    if (edges[e].edge != edges[e - 1].edge) continue;
    sets.Join(edges[e - 1].facet, edges[e].facet);
  }
  std::vector<int32_t> part_of_root(facets.size(), kNoMatch);
  std::vector<std::vector<Facet>> parts;
  for (size_t f = 0; f < facets.size(); ++f) {
    int32_t& part = part_of_root[sets.Root(static_cast<int32_t>(f))];
    if (part == kNoMatch) {
      part = static_cast<int32_t>(parts.size());
      parts.emplace_back();
    }
    parts[part].push_back(facets[f]);
  }
  return parts;
}

}  // namespace liquidblend::spacetime
