#include "worker/ingest/clean/check.h"

#include <algorithm>
#include <span>
#include <string>

#include "absl/strings/str_cat.h"
#include "core/mesh/union_find.h"
#include "worker/ingest/clean/non_manifold.h"

namespace liquidblend::ingest {
namespace {

struct Side {
  uint64_t edge;  // lower vertex in the upper half, higher vertex in the lower half
  int32_t side;   // 3 * triangle + side
};

std::vector<Side> SortedSides(const mesh::TriangleMesh& mesh) {
  std::vector<Side> sides;
  sides.reserve(3 * mesh.num_triangles());
  for (int32_t t = 0; t < mesh.num_triangles(); ++t) {
    for (int32_t k = 0; k < 3; ++k) {
      const auto a = static_cast<uint32_t>(mesh.triangles(k, t));
      const auto b = static_cast<uint32_t>(mesh.triangles((k + 1) % 3, t));
      sides.push_back({uint64_t{std::min(a, b)} << 32 | std::max(a, b), 3 * t + k});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return a.edge != b.edge ? a.edge < b.edge : a.side < b.side;
  });
  return sides;
}

// The sides along one edge, from the front of `sides`.
std::span<const Side> FirstEdge(std::span<const Side> sides) {
  size_t count = 1;
  while (count < sides.size() && sides[count].edge == sides[0].edge) ++count;
  return sides.first(count);
}

int32_t CornerOf(const mesh::TriangleMesh& mesh, int32_t t, int32_t v) {
  for (int32_t k = 0; k < 2; ++k) {
    if (mesh.triangles(k, t) == v) return k;
  }
  return 2;
}

bool RunsUp(const mesh::TriangleMesh& mesh, const Side& side) {
  return static_cast<uint32_t>(mesh.triangles(side.side % 3, side.side / 3)) == side.edge >> 32;
}

int64_t NumUp(const mesh::TriangleMesh& mesh, std::span<const Side> edge) {
  return std::count_if(edge.begin(), edge.end(),
                       [&](const Side& side) { return RunsUp(mesh, side); });
}

bool IsBalanced(const mesh::TriangleMesh& mesh, std::span<const Side> edge) {
  return 2 * NumUp(mesh, edge) == std::ssize(edge);
}

// The ends of an edge, in messages.
struct EdgeWords {
  std::string name;           // "edge (1, 2)", or "an edge" of a file without numbers
  std::string first, second;  // its vertices
  std::string place;          // where they are
};

std::string PlaceOf(const mesh::TriangleMesh& mesh, uint64_t v) {
  const auto p = mesh.vertices.col(static_cast<Eigen::Index>(v));
  return absl::StrCat("(", p.x(), ", ", p.y(), ", ", p.z(), ")");
}

EdgeWords WordsOf(const mesh::TriangleMesh& mesh, uint64_t edge, VertexNumbers numbers) {
  const uint64_t a = edge >> 32, b = edge & 0xffffffffu;
  const uint64_t base = numbers == VertexNumbers::kFromOne ? 1 : 0;
  EdgeWords words;
  words.place = absl::StrCat("from ", PlaceOf(mesh, a), " to ", PlaceOf(mesh, b), " m");
  if (numbers == VertexNumbers::kNone) {
    words.name = "an edge";
    words.first = PlaceOf(mesh, a);
    words.second = PlaceOf(mesh, b);
    return words;
  }
  words.first = absl::StrCat(a + base);
  words.second = absl::StrCat(b + base);
  words.name = absl::StrCat("edge (", words.first, ", ", words.second, ")");
  absl::StrAppend(&words.place, ", vertices counted from ", base);
  return words;
}

// Holes: sets of open edges that hang together.
std::string CountHoles(const mesh::TriangleMesh& mesh, std::span<const Side> sides) {
  mesh::UnionFind rims(mesh.num_vertices());
  std::vector<int32_t> on_rim;
  int64_t num_open = 0;
  for (std::span<const Side> rest = sides; !rest.empty();) {
    const std::span<const Side> edge = FirstEdge(rest);
    rest = rest.subspan(edge.size());
    if (edge.size() != 1) continue;
    ++num_open;
    on_rim.push_back(static_cast<int32_t>(edge[0].edge >> 32));
    rims.Join(on_rim.back(), static_cast<int32_t>(edge[0].edge & 0xffffffffu));
  }
  for (int32_t& v : on_rim) v = rims.Root(v);
  std::sort(on_rim.begin(), on_rim.end());
  const auto num_holes = std::unique(on_rim.begin(), on_rim.end()) - on_rim.begin();
  return absl::StrCat(num_holes, num_holes == 1 ? " hole with " : " holes with ", num_open,
                      " open edges in all");
}

//   sides  of all edges
//   edge   sides of the edge at fault
absl::Status UnbalancedError(const mesh::TriangleMesh& mesh, std::span<const Side> sides,
                             std::span<const Side> edge, VertexNumbers numbers) {
  const EdgeWords words = WordsOf(mesh, edge[0].edge, numbers);
  if (edge.size() == 1) {
    return absl::InvalidArgumentError(
        absl::StrCat(words.name, " has only 1 triangle: the surface is open there (", words.place,
                     "); ", CountHoles(mesh, sides),
                     "; fill them before the import, or write the liquid's whole surface"));
  }
  if (edge.size() > 2) {
    return absl::InvalidArgumentError(
        absl::StrCat(words.name, " has ", edge.size(), " triangles, of which ", NumUp(mesh, edge),
                     " run from ", words.first, " to ", words.second,
                     ": an edge of a closed surface has as many as run back (", words.place,
                     "); remove doubled or inner triangles before the import"));
  }
  return absl::InvalidArgumentError(
      absl::StrCat(words.name,
                   " is run through twice in one direction: its triangles are not "
                   "oriented alike (",
                   words.place, "); turn them all outward before the import"));
}

void Join(int32_t side, int32_t other, Neighbours& neighbours) {
  neighbours[side / 3][side % 3] = other / 3;
  neighbours[other / 3][other % 3] = side / 3;
}

}  // namespace

absl::StatusOr<Pairing> FindNeighbours(const mesh::TriangleMesh& mesh, VertexNumbers numbers) {
  const std::vector<Side> sides = SortedSides(mesh);
  Pairing pairing;
  pairing.neighbours.resize(mesh.num_triangles());
  std::vector<int32_t> crowd;
  for (std::span<const Side> rest = sides; !rest.empty();) {
    const std::span<const Side> edge = FirstEdge(rest);
    rest = rest.subspan(edge.size());
    if (!IsBalanced(mesh, edge)) return UnbalancedError(mesh, sides, edge, numbers);
    if (edge.size() == 2) {
      Join(edge[0].side, edge[1].side, pairing.neighbours);
      continue;
    }
    ++pairing.num_non_manifold;
    crowd.clear();
    for (const Side& side : edge) crowd.push_back(side.side);
    PairAcrossLiquid(mesh, crowd);
    for (size_t i = 0; i < crowd.size(); i += 2) {
      Join(crowd[i], crowd[i + 1], pairing.neighbours);
    }
  }
  return pairing;
}

std::vector<bool> FindOpenVertices(const mesh::TriangleMesh& mesh) {
  const std::vector<Side> sides = SortedSides(mesh);
  std::vector<bool> is_open(mesh.num_vertices(), false);
  for (std::span<const Side> rest = sides; !rest.empty();) {
    const std::span<const Side> edge = FirstEdge(rest);
    rest = rest.subspan(edge.size());
    if (IsBalanced(mesh, edge)) continue;
    is_open[edge[0].edge >> 32] = true;
    is_open[edge[0].edge & 0xffffffffu] = true;
  }
  return is_open;
}

std::vector<int32_t> FindSharedSides(const mesh::TriangleMesh& mesh) {
  const std::vector<Side> sides = SortedSides(mesh);
  std::vector<int32_t> shared;
  for (std::span<const Side> rest = sides; !rest.empty();) {
    const std::span<const Side> edge = FirstEdge(rest);
    rest = rest.subspan(edge.size());
    bool is_first = true;
    for (const Side& side : edge) {
      if (!RunsUp(mesh, side)) continue;
      if (!is_first) shared.push_back(side.side);
      is_first = false;
    }
  }
  return shared;
}

int64_t SplitPinchedVertices(const Neighbours& neighbours, mesh::TriangleMesh& mesh) {
  const int64_t num_before = mesh.num_vertices();
  std::vector<bool> is_visited(3 * mesh.num_triangles(), false);  // per corner
  std::vector<bool> has_fan(num_before, false);
  std::vector<int32_t> origin;  // of each copy
  for (int32_t first = 0; first < mesh.num_triangles(); ++first) {
    for (int32_t first_corner = 0; first_corner < 3; ++first_corner) {
      if (is_visited[3 * first + first_corner]) continue;
      const int32_t v = mesh.triangles(first_corner, first);
      const bool is_pinched = has_fan[v];
      has_fan[v] = true;
      const auto copy = static_cast<int32_t>(num_before + static_cast<int64_t>(origin.size()));
      if (is_pinched) origin.push_back(v);
      int32_t t = first;
      int32_t corner = first_corner;
      do {
        is_visited[3 * t + corner] = true;
        const int32_t next = neighbours[t][corner];
        if (is_pinched) mesh.triangles(corner, t) = copy;
        t = next;
        corner = CornerOf(mesh, t, v);
      } while (t != first);
    }
  }
  const auto num_copies = static_cast<int64_t>(origin.size());
  const bool has_velocities = mesh.velocities.cols() > 0;
  mesh.vertices.conservativeResize(3, num_before + num_copies);
  if (has_velocities) mesh.velocities.conservativeResize(3, num_before + num_copies);
  for (int64_t i = 0; i < num_copies; ++i) {
    mesh.vertices.col(num_before + i) = mesh.vertices.col(origin[i]);
    if (has_velocities) mesh.velocities.col(num_before + i) = mesh.velocities.col(origin[i]);
  }
  return num_copies;
}

}  // namespace liquidblend::ingest
