// Closed surfaces of functions, for animations whose connectivity and topology change.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/functional/function_ref.h"
#include "core/mesh/animation.h"
#include "core/mesh/triangle_mesh.h"

namespace liquidblend::synthetic {

struct GridBox {
  Eigen::Vector3f min_m = {-1, -1, -1};
  Eigen::Vector3f max_m = {1, 1, 1};
  double spacing_m = 0.1;  // > 0
};

// The surface value(p) = 0 by marching tetrahedra; inside is value < 0, normals point out of it.
// Closed and oriented for any function: outside of the box counts as outside. Crossings are kept
// 5 % of an edge off the grid points, so there are no slivers.
mesh::TriangleMesh Polygonize(absl::FunctionRef<double(const Eigen::Vector3d&)> value,
                              const GridBox& box);

struct FallingDropOptions {
  Eigen::Vector3f drop_m = {0, 0, 0.55f};  // centre at frame 0
  double drop_radius_m = 0.2;              // > 0
  double drop_velocity_m_per_s = -1.2;     // along z
  double pool_depth_m = 0.5;               // of a box-shaped pool, its top at z = 0
  double frames_per_second = 24;           // > 0
  int num_frames = 16;                     // >= 1
  double spacing_m = 0.08;                 // > 0; of the grid that frames are polygonized on
};

// A ball that sinks into a pool and merges with it: no shared connectivity, two components become
// one. Velocities: the drop's near the drop, 0 in the pool.
mesh::Animation FallingDrop(const FallingDropOptions& options = {});

struct SteadyDrop {
  Eigen::Vector3d centre_m = {0, 0, 0.55};  // at frame 0
  double radius_m = 0.25;                   // > 0
  double released_frame = 0.0;              // hangs in the air until then
  double bridge_radius_m = 0.0;             // > 0: a column connects it with the pool
};

struct FallingDropsOptions {
  std::vector<SteadyDrop> drops;
  double velocity_m_per_s = -1.2;              // along z, once released
  Eigen::Vector2d pool_half_width_m = {1, 1};  // of a box-shaped pool, its top at z = 0
  double pool_depth_m = 0.3;
  double height_m = 1.2;          // > 0; nothing is above
  double frames_per_second = 24;  // > 0
  int num_frames = 20;            // >= 1
  double spacing_m = 0.1;         // > 0; of the grid that frames are polygonized on
};

// The same with any number of drops. Velocities: the drops' near them, 0 in the pool.
mesh::Animation FallingDrops(const FallingDropsOptions& options);

}  // namespace liquidblend::synthetic
