// A triangle surface as a PLY or OBJ file.
#pragma once

#include <string>

#include "core/mesh/triangle_mesh.h"

namespace liquidblend::encode {

// Encodes a mesh as binary little-endian PLY: x y z, nx ny nz and vx vy vz (m/s) where the mesh has
// them, as floats; faces with int indices. Triangles that name a vertex twice are left out.
// Requires: mesh passed Validate().  Threads: safe, same bytes always.  Cost: 10 ns per triangle.
std::string EncodePly(const mesh::TriangleMesh& mesh);

// Encodes a mesh as OBJ: v, vn where the mesh has normals, and f; numbers read back to the same
// bits. OBJ cannot hold velocities. Otherwise as EncodePly().  Cost: 200 ns per triangle.
std::string EncodeObj(const mesh::TriangleMesh& mesh);

}  // namespace liquidblend::encode
