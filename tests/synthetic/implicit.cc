#include "tests/synthetic/implicit.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <utility>
#include <vector>

namespace liquidblend::synthetic {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;
using Eigen::Vector3i;
using mesh::TriangleMesh;

// Corners of the six tetrahedra around the diagonal of a cube; corner = x + 2 y + 4 z. All have
// positive orientation.
constexpr std::array<std::array<int, 4>, 6> kTetrahedra = {
    {{0, 1, 3, 7}, {0, 2, 6, 7}, {0, 4, 5, 7}, {0, 1, 7, 5}, {0, 2, 7, 3}, {0, 4, 7, 6}}};

class Polygonizer {
 public:
  Polygonizer(absl::FunctionRef<double(const Vector3d&)> value, const GridBox& box) : box_(box) {
    for (int axis = 0; axis < 3; ++axis) {
      const double length_m = box.max_m[axis] - box.min_m[axis];
      size_[axis] = static_cast<int>(std::lround(length_m / box.spacing_m)) + 1;
    }
    sample_.resize(size_t(size_[0]) * size_[1] * size_[2]);
    for (int64_t i = 0; i < static_cast<int64_t>(sample_.size()); ++i) {
      sample_[i] = value(Position(i));
      const Vector3i c = Coordinates(i);
      if ((c.array() == 0).any() || (c.array() == size_.array() - 1).any()) {
        sample_[i] = std::max(sample_[i], std::numeric_limits<double>::min());
      }
    }
  }

  TriangleMesh Run() {
    for (int z = 0; z + 1 < size_[2]; ++z) {
      for (int y = 0; y + 1 < size_[1]; ++y) {
        for (int x = 0; x + 1 < size_[0]; ++x) {
          for (const auto& corners : kTetrahedra) {
            std::array<int64_t, 4> tetrahedron;
            for (int k = 0; k < 4; ++k) {
              const int c = corners[k];
              tetrahedron[k] = Index({x + (c & 1), y + (c >> 1 & 1), z + (c >> 2)});
            }
            AddTetrahedron(tetrahedron);
          }
        }
      }
    }
    return Result();
  }

 private:
  int64_t Index(const Vector3i& c) const {
    return c[0] + int64_t{size_[0]} * (c[1] + int64_t{size_[1]} * c[2]);
  }
  Vector3i Coordinates(int64_t i) const {
    return {static_cast<int>(i % size_[0]), static_cast<int>(i / size_[0] % size_[1]),
            static_cast<int>(i / size_[0] / size_[1])};
  }
  Vector3d Position(int64_t i) const {
    return box_.min_m.cast<double>() + box_.spacing_m * Coordinates(i).cast<double>();
  }

  // The vertex where the surface crosses the edge of two grid points.
  int Crossing(int64_t a, int64_t b) {
    if (a > b) std::swap(a, b);
    const auto [entry, is_new] = crossing_.try_emplace({a, b}, static_cast<int>(vertices_.size()));
    if (is_new) {
      const double share = std::clamp(sample_[a] / (sample_[a] - sample_[b]), 0.05, 0.95);
      vertices_.push_back((1 - share) * Position(a) + share * Position(b));
    }
    return entry->second;
  }

  void AddTetrahedron(const std::array<int64_t, 4>& corner) {
    // Even permutations: first the single corner (or the pair) on one side, then the others.
    constexpr int kSingle[4][4] = {{0, 1, 2, 3}, {1, 0, 3, 2}, {2, 0, 1, 3}, {3, 0, 2, 1}};
    constexpr int kPair[6][4] = {{0, 1, 2, 3}, {0, 2, 3, 1}, {0, 3, 1, 2},
                                 {1, 2, 0, 3}, {1, 3, 2, 0}, {2, 3, 0, 1}};
    int inside = 0;
    for (int k = 0; k < 4; ++k) inside |= sample_[corner[k]] < 0 ? 1 << k : 0;
    for (int i = 0; i < 4; ++i) {
      const auto& p = kSingle[i];
      if (inside != 1 << i && inside != (15 ^ 1 << i)) continue;
      Vector3i triangle;
      for (int k = 0; k < 3; ++k) triangle[k] = Crossing(corner[p[0]], corner[p[k + 1]]);
      if (inside != 1 << i) std::swap(triangle[1], triangle[2]);
      triangles_.push_back(triangle);
    }
    for (const auto& p : kPair) {
      if (inside != (1 << p[0] | 1 << p[1])) continue;
      const int ik = Crossing(corner[p[0]], corner[p[2]]);
      const int il = Crossing(corner[p[0]], corner[p[3]]);
      const int jl = Crossing(corner[p[1]], corner[p[3]]);
      const int jk = Crossing(corner[p[1]], corner[p[2]]);
      triangles_.emplace_back(ik, il, jl);
      triangles_.emplace_back(ik, jl, jk);
    }
  }

  TriangleMesh Result() const {
    TriangleMesh mesh;
    mesh.vertices.resize(3, static_cast<Eigen::Index>(vertices_.size()));
    mesh.triangles.resize(3, static_cast<Eigen::Index>(triangles_.size()));
    for (size_t v = 0; v < vertices_.size(); ++v) mesh.vertices.col(v) = vertices_[v].cast<float>();
    for (size_t t = 0; t < triangles_.size(); ++t) mesh.triangles.col(t) = triangles_[t];
    return mesh;
  }

  const GridBox& box_;
  Vector3i size_;               // grid points along each axis
  std::vector<double> sample_;  // per grid point, x fastest
  std::map<std::pair<int64_t, int64_t>, int> crossing_;
  std::vector<Vector3d> vertices_;
  std::vector<Vector3i> triangles_;
};

// Negative inside of the box, distance to it outside.
double BoxDistance(const Vector3d& p, const Vector3d& min_m, const Vector3d& max_m) {
  const Vector3d q = (min_m - p).cwiseMax(p - max_m);
  return q.cwiseMax(0).norm() + std::min(q.maxCoeff(), 0.0);
}

}  // namespace

TriangleMesh Polygonize(absl::FunctionRef<double(const Vector3d&)> value, const GridBox& box) {
  assert(box.spacing_m > 0);
  return Polygonizer(value, box).Run();
}

mesh::Animation FallingDrop(const FallingDropOptions& options) {
  assert(options.num_frames >= 1 && options.frames_per_second > 0);
  mesh::Animation animation;
  animation.name = "falling drop";
  animation.frames_per_second = options.frames_per_second;
  const Vector3d pool_min_m(-0.8, -0.8, -options.pool_depth_m);
  const Vector3d pool_max_m(0.8, 0.8, 0);
  const GridBox box = {.min_m = {-1, -1, static_cast<float>(-options.pool_depth_m - 0.2)},
                       .max_m = {1, 1, 1},
                       .spacing_m = options.spacing_m};
  for (int k = 0; k < options.num_frames; ++k) {
    const double fall_m = options.drop_velocity_m_per_s * k / options.frames_per_second;
    const Vector3d drop_m = options.drop_m.cast<double>() + Vector3d(0, 0, fall_m);
    TriangleMesh frame = Polygonize(
        [&](const Vector3d& p) {
          return std::min((p - drop_m).norm() - options.drop_radius_m,
                          BoxDistance(p, pool_min_m, pool_max_m));
        },
        box);
    frame.velocities.setZero(3, frame.num_vertices());
    for (int v = 0; v < frame.num_vertices(); ++v) {
      const Vector3d p = frame.vertices.col(v).cast<double>();
      const bool on_drop = std::abs((p - drop_m).norm() - options.drop_radius_m) <
                           std::abs(BoxDistance(p, pool_min_m, pool_max_m));
      if (on_drop) frame.velocities(2, v) = static_cast<float>(options.drop_velocity_m_per_s);
    }
    animation.frames.push_back(std::move(frame));
  }
  return animation;
}

namespace {

// One frame of FallingDrops(): its drops where they are by then.
TriangleMesh FrameOf(const FallingDropsOptions& options, int k) {
  const Eigen::Vector2d half_m = options.pool_half_width_m;
  const Vector3d pool_min_m(-half_m[0], -half_m[1], -options.pool_depth_m);
  const Vector3d pool_max_m(half_m[0], half_m[1], 0);
  const Vector3d margin_m = Vector3d::Constant(2 * options.spacing_m);
  const GridBox box = {
      .min_m = (pool_min_m - margin_m).cast<float>(),
      .max_m = Vector3d(half_m[0] + margin_m[0], half_m[1] + margin_m[1], options.height_m)
                   .cast<float>(),
      .spacing_m = options.spacing_m};
  const auto distance_to = [&](const SteadyDrop& drop, const Vector3d& p) {
    const double falls_s = std::max(0.0, k - drop.released_frame) / options.frames_per_second;
    const Vector3d centre_m = drop.centre_m + Vector3d(0, 0, options.velocity_m_per_s * falls_s);
    const double to_drop = (p - centre_m).norm() - drop.radius_m;
    if (!(drop.bridge_radius_m > 0)) return to_drop;
    const double to_axis = (p - centre_m).head<2>().norm() - drop.bridge_radius_m;
    const double below = -options.pool_depth_m / 2 - p.z();  // its end is in the pool
    return std::min(to_drop, std::max({to_axis, p.z() - centre_m.z(), below}));
  };
  TriangleMesh frame = Polygonize(
      [&](const Vector3d& p) {
        double value = BoxDistance(p, pool_min_m, pool_max_m);
        for (const SteadyDrop& drop : options.drops) value = std::min(value, distance_to(drop, p));
        return value;
      },
      box);
  frame.velocities.setZero(3, frame.num_vertices());
  for (int v = 0; v < frame.num_vertices(); ++v) {
    const Vector3d p = frame.vertices.col(v).cast<double>();
    const double to_pool = std::abs(BoxDistance(p, pool_min_m, pool_max_m));
    for (const SteadyDrop& drop : options.drops) {
      if (k < drop.released_frame || std::abs(distance_to(drop, p)) >= to_pool) continue;
      frame.velocities(2, v) = static_cast<float>(options.velocity_m_per_s);
    }
  }
  return frame;
}

}  // namespace

mesh::Animation FallingDrops(const FallingDropsOptions& options) {
  assert(options.num_frames >= 1 && options.frames_per_second > 0);
  mesh::Animation animation;
  animation.name = "falling drops";
  animation.frames_per_second = options.frames_per_second;
  for (int k = 0; k < options.num_frames; ++k) animation.frames.push_back(FrameOf(options, k));
  return animation;
}

}  // namespace liquidblend::synthetic
