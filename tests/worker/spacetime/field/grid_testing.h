// Surfaces in grid units for the tests of space-time surface nets.
#pragma once

#include "tests/synthetic/shapes.h"
#include "worker/spacetime/field/grid.h"

namespace liquidblend::spacetime {

inline Grid CubeGrid(int points_per_side) {
  Grid grid;
  grid.dims = {points_per_side, points_per_side, points_per_side};
  return grid;
}

inline GridSurface InGrid(const mesh::TriangleMesh& mesh) {
  return {mesh.vertices, mesh.triangles, mesh.velocities};
}

inline Eigen::Vector3f PointAt(int i, int j, int k) {
  return Eigen::Vector3i(i, j, k).cast<float>();
}

}  // namespace liquidblend::spacetime
