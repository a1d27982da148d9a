#include "tests/synthetic/voxels.h"

#include <algorithm>
#include <random>

namespace liquidblend::synthetic {
namespace {

using Eigen::Vector3i;

int Index(int n, const Vector3i& p) { return p[0] + n * (p[1] + n * p[2]); }

bool IsLiquid(const Voxels& voxels, const Vector3i& p) { return voxels.At(p[0], p[1], p[2]); }

template <typename Visit>
void ForEachLiquid(const Voxels& voxels, const Visit& visit) {
  const int n = voxels.num_per_side;
  for (int z = 0; z < n; ++z) {
    for (int y = 0; y < n; ++y) {
      for (int x = 0; x < n; ++x) {
        if (voxels.At(x, y, z)) visit(Vector3i(x, y, z));
      }
    }
  }
}

}  // namespace

bool Voxels::At(int x, int y, int z) const {
  const Vector3i p(x, y, z);
  if (p.minCoeff() < 0 || p.maxCoeff() >= num_per_side) return false;
  return is_liquid[Index(num_per_side, p)];
}

Voxels RandomVoxels(int num_per_side, double share, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::bernoulli_distribution is_liquid(share);
  Voxels voxels;
  voxels.num_per_side = num_per_side;
  voxels.is_liquid.resize(num_per_side * num_per_side * num_per_side);
  for (size_t i = 0; i < voxels.is_liquid.size(); ++i) voxels.is_liquid[i] = is_liquid(random);
  return voxels;
}

mesh::TriangleMesh VoxelSurface(const Voxels& voxels) {
  const int num_corners = voxels.num_per_side + 1;
  std::vector<int> vertex_of(num_corners * num_corners * num_corners, -1);
  std::vector<Vector3i> vertices;
  std::vector<Vector3i> triangles;
  const auto vertex = [&](const Vector3i& p) {
    int& v = vertex_of[Index(num_corners, p)];
    if (v < 0) {
      v = static_cast<int>(vertices.size());
      vertices.push_back(p);
    }
    return v;
  };
  ForEachLiquid(voxels, [&](const Vector3i& cube) {
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3i along = Vector3i::Unit(axis);
      const Vector3i u = Vector3i::Unit((axis + 1) % 3);
      const Vector3i v = Vector3i::Unit((axis + 2) % 3);
      for (const int side : {0, 1}) {
        if (IsLiquid(voxels, cube + (2 * side - 1) * along)) continue;
        const Vector3i at = cube + side * along;
        int corners[4] = {vertex(at), vertex(at + u), vertex(at + u + v), vertex(at + v)};
        if (side == 0) std::swap(corners[1], corners[3]);
        triangles.emplace_back(corners[0], corners[1], corners[2]);
        triangles.emplace_back(corners[0], corners[2], corners[3]);
      }
    }
  });
  mesh::TriangleMesh mesh;
  mesh.vertices.resize(3, std::ssize(vertices));
  for (size_t i = 0; i < vertices.size(); ++i) mesh.vertices.col(i) = vertices[i].cast<float>();
  mesh.triangles.resize(3, std::ssize(triangles));
  for (size_t i = 0; i < triangles.size(); ++i) mesh.triangles.col(i) = triangles[i];
  return mesh;
}

int NumParts(const Voxels& voxels) {
  Voxels rest = voxels;
  int num_parts = 0;
  ForEachLiquid(voxels, [&](const Vector3i& first) {
    if (!IsLiquid(rest, first)) return;
    ++num_parts;
    std::vector<Vector3i> reached = {first};
    rest.is_liquid[Index(rest.num_per_side, first)] = false;
    while (!reached.empty()) {
      const Vector3i cube = reached.back();
      reached.pop_back();
      for (int axis = 0; axis < 3; ++axis) {
        for (const int step : {-1, 1}) {
          const Vector3i next = cube + step * Vector3i::Unit(axis);
          if (!IsLiquid(rest, next)) continue;
          rest.is_liquid[Index(rest.num_per_side, next)] = false;
          reached.push_back(next);
        }
      }
    }
  });
  return num_parts;
}

}  // namespace liquidblend::synthetic
