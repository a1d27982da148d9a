#include "tests/synthetic/sheet.h"

#include <cmath>
#include <numbers>
#include <vector>

namespace liquidblend::synthetic {
namespace {

// Number of the first vertex of a ring; ring r > 0 has 6 r vertices.
int RingBegin(int ring) { return ring == 0 ? 0 : 1 + 3 * ring * (ring - 1); }

Eigen::Vector3f PointOf(const SheetOptions& options, double along_m, double angle, double up_m) {
  const double turn = options.bend_m > 0 ? along_m / options.bend_m : 0.0;
  const double out_m = options.bend_m > 0 ? (options.bend_m + up_m) * std::sin(turn) : along_m;
  const double z_m =
      options.bend_m > 0 ? (options.bend_m + up_m) * std::cos(turn) - options.bend_m : up_m;
  return Eigen::Vector3d(out_m * std::cos(angle), out_m * std::sin(angle), z_m).cast<float>();
}

// Triangles of the top; each sextant of a ring has one more to the inside than its number.
void AddDisc(int num_rings, std::vector<Eigen::Vector3i>& triangles) {
  for (int ring = 1; ring <= num_rings; ++ring) {
    const int outer = RingBegin(ring), inner = RingBegin(ring - 1);
    const int num_outer = 6 * ring, num_inner = ring == 1 ? 1 : 6 * (ring - 1);
    for (int sextant = 0; sextant < 6; ++sextant) {
      for (int n = 0; n < ring; ++n) {
        const int a = outer + sextant * ring + n, b = outer + (sextant * ring + n + 1) % num_outer;
        const int c = inner + (sextant * (ring - 1) + n) % num_inner;
        triangles.emplace_back(c, a, b);
        if (n + 1 == ring) continue;
        triangles.emplace_back(c, b, inner + (sextant * (ring - 1) + n + 1) % num_inner);
      }
    }
  }
}

}  // namespace

mesh::TriangleMesh Sheet(const SheetOptions& options) {
  const int num_rings = static_cast<int>(std::lround(options.radius_m / options.edge_m));
  const int num_side = RingBegin(num_rings + 1), rim = RingBegin(num_rings);
  std::vector<Eigen::Vector3i> triangles;
  AddDisc(num_rings, triangles);
  const size_t num_top = triangles.size();
  for (size_t t = 0; t < num_top; ++t) {
    const Eigen::Vector3i top = triangles[t];
    triangles.emplace_back(top[0] + num_side, top[2] + num_side, top[1] + num_side);
  }
  for (int a = rim; a < num_side; ++a) {
    const int b = a + 1 == num_side ? rim : a + 1;
    triangles.emplace_back(a, a + num_side, b);
    triangles.emplace_back(b, a + num_side, b + num_side);
  }
  mesh::TriangleMesh mesh;
  mesh.vertices.resize(3, 2 * num_side);
  for (int ring = 0; ring <= num_rings; ++ring) {
    for (int v = RingBegin(ring); v < RingBegin(ring + 1); ++v) {
      const double angle =
          ring == 0 ? 0.0 : 2 * std::numbers::pi * (v - RingBegin(ring)) / (6.0 * ring);
      const double along_m = options.radius_m * ring / num_rings;
      mesh.vertices.col(v) = PointOf(options, along_m, angle, 0.5 * options.thickness_m);
      mesh.vertices.col(v + num_side) =
          PointOf(options, along_m, angle, -0.5 * options.thickness_m);
    }
  }
  mesh.triangles.resize(3, static_cast<int64_t>(triangles.size()));
  for (size_t t = 0; t < triangles.size(); ++t) mesh.triangles.col(t) = triangles[t];
  return mesh;
}

}  // namespace liquidblend::synthetic
