#include "client/src/decode/draco_mesh.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <numeric>
#include <vector>

namespace liquidblend {
namespace {

struct Edge {
  uint32_t low, high;
  int direction;  // +1 from low to high
};

// Vertices at edges that are not run through as often in one direction as in the other, ascending.
std::vector<uint32_t> OpenVertices(const Mesh& mesh) {
  std::vector<Edge> edges;
  edges.reserve(mesh.triangles.size());
  for (size_t t = 0; t + 2 < mesh.triangles.size(); t += 3) {
    for (size_t c = 0; c < 3; ++c) {
      const uint32_t a = mesh.triangles[t + c], b = mesh.triangles[t + (c + 1) % 3];
      edges.push_back({std::min(a, b), std::max(a, b), a < b ? 1 : -1});
    }
  }
  const auto before = [](const Edge& a, const Edge& b) {
    return a.low != b.low ? a.low < b.low : a.high < b.high;
  };
  std::sort(edges.begin(), edges.end(), before);
  std::vector<uint32_t> open;
  for (size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
    int sum = 0;
    while (end < edges.size() && !before(edges[begin], edges[end])) sum += edges[end++].direction;
    if (sum != 0) open.insert(open.end(), {edges[begin].low, edges[begin].high});
  }
  std::sort(open.begin(), open.end());
  open.erase(std::unique(open.begin(), open.end()), open.end());
  return open;
}

std::array<float, 3> PositionOf(const Mesh& mesh, uint32_t v) {
  const float* p = &mesh.positions[3 * static_cast<size_t>(v)];
  return {p[0], p[1], p[2]};
}

constexpr uint32_t kUnused = std::numeric_limits<uint32_t>::max();

// Moves `size` numbers per vertex to the vertex' new number.
void Renumber(const std::vector<uint32_t>& number, uint32_t count, size_t size,
              std::vector<float>& values) {
  if (values.empty()) return;
  for (size_t v = 0; v < number.size(); ++v) {
    if (number[v] == kUnused) continue;
    std::copy_n(&values[size * v], size, &values[size * number[v]]);
  }
  values.resize(size * count);
}

// Renumbers the vertices in use, in their order, and drops the others.
void DropUnused(Mesh& mesh) {
  std::vector<uint32_t> number(mesh.num_vertices(), kUnused);
  for (const uint32_t v : mesh.triangles) number[v] = 0;
  uint32_t count = 0;
  for (uint32_t& n : number) {
    if (n != kUnused) n = count++;
  }
  Renumber(number, count, 3, mesh.positions);
  Renumber(number, count, 3, mesh.normals);
  Renumber(number, count, 3, mesh.velocities);
  Renumber(number, count, 4, mesh.rest);
  for (uint32_t& v : mesh.triangles) v = number[v];
}

}  // namespace

void WeldOpenEdges(Mesh& mesh) {
  std::vector<uint32_t> open = OpenVertices(mesh);
  if (open.empty()) return;
  std::stable_sort(open.begin(), open.end(), [&](uint32_t a, uint32_t b) {
    return PositionOf(mesh, a) < PositionOf(mesh, b);
  });
  std::vector<uint32_t> joined(mesh.num_vertices());
  std::iota(joined.begin(), joined.end(), 0u);
  for (size_t n = 1; n < open.size(); ++n) {
    if (PositionOf(mesh, open[n]) == PositionOf(mesh, open[n - 1])) {
      joined[open[n]] = joined[open[n - 1]];
    }
  }
  std::vector<uint32_t> triangles;
  triangles.reserve(mesh.triangles.size());
  for (size_t t = 0; t + 2 < mesh.triangles.size(); t += 3) {
    const uint32_t a = joined[mesh.triangles[t]], b = joined[mesh.triangles[t + 1]],
                   c = joined[mesh.triangles[t + 2]];
    if (a == b || b == c || c == a) continue;
    triangles.insert(triangles.end(), {a, b, c});
  }
  mesh.triangles = std::move(triangles);
  DropUnused(mesh);
}

}  // namespace liquidblend
