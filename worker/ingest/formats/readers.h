// One frame's bytes -> a mesh in the file's own units and numbering; a source file per format.
//
// Pure functions of the bytes. Counts, truncation and syntax are checked here, in messages that
// name the element but not the file; finite numbers and closedness are for the caller to check.
// Errors: kInvalidArgument, kDataLoss.  Threads: safe.  Cost: O(bytes).
// Memory, hostile files included: what a count promises is allocated only if the file can hold it.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "absl/status/statusor.h"
#include "core/mesh/triangle_mesh.h"

namespace liquidblend::ingest {

// A .bobj.gz of Mantaflow: positions in the unit cube around 0; no velocities.
// Memory of both: MaxInflatedSize of the bytes, see gzip.h.
absl::StatusOr<mesh::TriangleMesh> ReadMantaflowMesh(std::span<const std::byte> bytes);

// The .uni beside it: one velocity per vertex, in simulation cells per Mantaflow time unit.
absl::StatusOr<Eigen::Matrix3Xf> ReadMantaflowVelocities(std::span<const std::byte> bytes,
                                                         int64_t num_vertices);

// PLY 1.0. Elements vertex (x y z, optionally vx vy vz) and face (vertex_indices or vertex_index);
// other elements and properties are skipped, polygons cut into triangles.
// Memory: at most 32 for each byte.
absl::StatusOr<mesh::TriangleMesh> ReadPly(std::span<const std::byte> bytes);

// Wavefront OBJ. Statements v and f; others are skipped, polygons cut into triangles.
// Memory: at most 32 for each byte.
absl::StatusOr<mesh::TriangleMesh> ReadObj(std::span<const std::byte> bytes);

// STL, binary or ascii. Corners at exactly the same position become one vertex; the normals are
// not read. Memory: at most 8 for each byte.
absl::StatusOr<mesh::TriangleMesh> ReadStl(std::span<const std::byte> bytes);

// OpenVDB. The surface of a float grid that is a level set, called "surface", else "density", else
// the first one; a vector grid "velocity", "vel" or "v", staggered or not, sampled at its vertices.
// Memory: at most 16 MiB and 320 for each byte. Errors: kResourceExhausted, too (no memory).
struct VdbFrame {
  mesh::TriangleMesh mesh;  // in world units: the grids' transforms are applied
  std::string level_set;    // name of the grid
  std::string velocities;   // name of the grid; empty: none
};
absl::StatusOr<VdbFrame> ReadVdb(std::span<const std::byte> bytes);

}  // namespace liquidblend::ingest
