// Surfaces of sets of unit cubes, which touch one another in all ways there are.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/mesh/triangle_mesh.h"

namespace liquidblend::synthetic {

struct Voxels {
  int num_per_side = 0;
  std::vector<bool> is_liquid;  // x fastest; outside of the block is air

  bool At(int x, int y, int z) const;
};

// Each cube is liquid by chance. Requires: num_per_side >= 1, 0 <= share <= 1.
Voxels RandomVoxels(int num_per_side, double share, uint64_t seed);

// Two triangles for each face between liquid and air, outward; cubes share their corners, so edges
// have four triangles where two cubes touch in one. In units of a cube.
mesh::TriangleMesh VoxelSurface(const Voxels& voxels);

// Parts of the liquid that are connected through faces.
int NumParts(const Voxels& voxels);

}  // namespace liquidblend::synthetic
