#include "client/cli/files/mesh_stats.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

namespace liquidblend::cli {
namespace {

using Vector = std::array<double, 3>;

Vector Position(const Mesh& mesh, uint32_t v) {
  const float* p = &mesh.positions[3 * static_cast<size_t>(v)];
  return {p[0], p[1], p[2]};
}

Vector Subtract(const Vector& a, const Vector& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

Vector Cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

double Dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
double Length(const Vector& a) { return std::sqrt(Dot(a, a)); }

void CountEdges(const Mesh& mesh, MeshStats* stats) {
  std::vector<std::pair<uint64_t, int>> edges;  // both ends, and the direction
  edges.reserve(mesh.triangles.size());
  for (size_t t = 0; t < mesh.num_triangles(); ++t) {
    for (size_t k = 0; k < 3; ++k) {
      const uint64_t a = mesh.triangles[3 * t + k];
      const uint64_t b = mesh.triangles[3 * t + (k + 1) % 3];
      edges.emplace_back(std::min(a, b) << 32 | std::max(a, b), a < b ? 1 : -1);
    }
  }
  std::sort(edges.begin(), edges.end());
  for (size_t begin = 0; begin < edges.size();) {
    size_t end = begin;
    int balance = 0;
    for (; end < edges.size() && edges[end].first == edges[begin].first; ++end) {
      balance += edges[end].second;
    }
    stats->num_odd_edges += (end - begin) % 2;
    stats->num_misoriented_edges += balance != 0;
    begin = end;
  }
}

int64_t CountComponents(const Mesh& mesh) {
  std::vector<uint32_t> parent(mesh.num_vertices());
  std::iota(parent.begin(), parent.end(), 0u);
  const auto find = [&](uint32_t v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  std::vector<bool> used(mesh.num_vertices(), false);
  for (size_t i = 0; i < mesh.triangles.size(); ++i) {
    used[mesh.triangles[i]] = true;
    parent[find(mesh.triangles[i])] = find(mesh.triangles[i - i % 3]);
  }
  int64_t count = 0;
  for (uint32_t v = 0; v < parent.size(); ++v) count += used[v] && find(v) == v;
  return count;
}

Bounds ComputeBounds(const Mesh& mesh) {
  if (mesh.positions.empty()) return {};
  Vector low = Position(mesh, 0);
  Vector high = low;
  for (size_t i = 0; i < mesh.positions.size(); ++i) {
    low[i % 3] = std::min<double>(low[i % 3], mesh.positions[i]);
    high[i % 3] = std::max<double>(high[i % 3], mesh.positions[i]);
  }
  return {{low[0], low[1], low[2]}, {high[0], high[1], high[2]}};
}

void Measure(const Mesh& mesh, MeshStats* stats) {
  double length = 0.0;
  for (size_t t = 0; t < mesh.num_triangles(); ++t) {
    const Vector a = Position(mesh, mesh.triangles[3 * t]);
    const Vector b = Position(mesh, mesh.triangles[3 * t + 1]);
    const Vector c = Position(mesh, mesh.triangles[3 * t + 2]);
    stats->volume_m3 += Dot(a, Cross(b, c)) / 6.0;
    stats->area_m2 += Length(Cross(Subtract(b, a), Subtract(c, a))) / 2.0;
    length += Length(Subtract(b, a)) + Length(Subtract(c, b)) + Length(Subtract(a, c));
  }
  if (mesh.num_triangles() > 0) {
    stats->mean_edge_length_m = length / static_cast<double>(3 * mesh.num_triangles());
  }
}

}  // namespace

MeshStats ComputeMeshStats(const Mesh& mesh) {
  MeshStats stats;
  stats.num_vertices = static_cast<int64_t>(mesh.num_vertices());
  stats.num_triangles = static_cast<int64_t>(mesh.num_triangles());
  stats.num_components = CountComponents(mesh);
  stats.bounds = ComputeBounds(mesh);
  CountEdges(mesh, &stats);
  Measure(mesh, &stats);
  return stats;
}

std::vector<float> VertexNormals(const Mesh& mesh) {
  std::vector<Vector> sums(mesh.num_vertices(), Vector{0.0, 0.0, 0.0});
  for (size_t t = 0; t < mesh.num_triangles(); ++t) {
    const uint32_t* v = &mesh.triangles[3 * t];
    const Vector a = Position(mesh, v[0]);
    const Vector n = Cross(Subtract(Position(mesh, v[1]), a), Subtract(Position(mesh, v[2]), a));
    for (size_t k = 0; k < 3; ++k) {
      for (size_t axis = 0; axis < 3; ++axis) sums[v[k]][axis] += n[axis];
    }
  }
  std::vector<float> normals;
  normals.reserve(3 * sums.size());
  for (const Vector& sum : sums) {
    const double length = Length(sum);
    for (size_t axis = 0; axis < 3; ++axis) {
      const double fallback = axis == 2 ? 1.0 : 0.0;
      normals.push_back(static_cast<float>(length > 0.0 ? sum[axis] / length : fallback));
    }
  }
  return normals;
}

}  // namespace liquidblend::cli
