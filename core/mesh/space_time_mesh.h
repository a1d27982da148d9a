// A liquid's surface in space-time: a three-dimensional cell complex in R^4.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "core/mesh/up.h"

namespace liquidblend::mesh {

// Corners of the four cell kinds, as vertex indices.
//   tetrahedron  0 1 2 3
//   pyramid      base quad 0 1 2 3 (in cyclic order), apex 4
//   wedge        triangles 0 1 2 and 3 4 5; corner c + 3 lies across from corner c
//   hexahedron   corner (a, b, c) in {0, 1}^3 has index a + 2 b + 4 c; corner c + 4 may be the same
//                vertex as corner c, for some c: there the cell is flat
// Orientation: with e1, e2, e3 the edges from corner 0 to corners 1, 2, 3 (tetrahedron), 1, 3, 4
// (pyramid), 1, 2, 3 (wedge), 1, 2, 4 (hexahedron) and N the normal that points out of the liquid,
// det(e1, e2, e3, N) > 0 in the order (x, y, z, t).
using Tetrahedron = std::array<int32_t, 4>;
using Pyramid = std::array<int32_t, 5>;
using Wedge = std::array<int32_t, 6>;
using Hexahedron = std::array<int32_t, 8>;

// A rigid piece: vertices that keep their shape, whatever moves the mesh. It is a droplet at one
// time (section 5.3).
struct RigidPiece {
  int32_t first_vertex = 0;
  int32_t num_vertices = 0;
  int32_t droplet = 0;  // pieces of one droplet have the same number and follow one another in time
};

// Invariant: every facet (triangle or quad) of a cell belongs to exactly two cells that run through
// it in opposite directions (or to four, two and two, where parts of the liquid touch), except
// facets all of whose vertices lie in the slab before the first frame or in the slab after the last
// one. So each slice at a time in [0, num_frames - 1] is a closed, oriented surface, however the
// vertices are moved, as long as those of the two end slabs stay outside of that interval.
struct SpaceTimeMesh {
  Eigen::Matrix4Xf vertices;    // x, y, z in metres, t in frames since the first frame; sorted so
                                // that the end slabs' vertices are the first and the last ones
  Eigen::Matrix4Xf normals;     // unit length, out of the liquid, in the metric where a frame is as
                                // long as edge_length_m; or no columns
  Eigen::Matrix3Xf velocities;  // metres per second; or no columns
  std::vector<Tetrahedron> tetrahedra;
  std::vector<Pyramid> pyramids;
  std::vector<Wedge> wedges;
  std::vector<Hexahedron> hexahedra;
  std::vector<char> thin;  // per vertex: part of a thin sheet (section 5.3); or empty: not known
  std::vector<RigidPiece> rigid_pieces;  // a droplet's together and ascending in time
  int64_t num_first_vertices = 0;  // in the slab before frame 0: columns [0, num_first_vertices)
  int64_t num_last_vertices = 0;   // in the slab after the last frame: the last columns
  int num_frames = 0;
  int num_pre_roll = 0;  // frames made up before frame 0; the slab before them is the first one
  double frames_per_second = 24.0;
  Up up = Up::kUnknown;
  double edge_length_m = 0.0;  // e of section 4.1: mean edge length of the animation

  int64_t num_vertices() const { return vertices.cols(); }
  int64_t num_cells() const {
    return static_cast<int64_t>(tetrahedra.size() + pyramids.size() + wedges.size() +
                                hexahedra.size());
  }
};

// For each vertex, whether it is part of a rigid piece (1 or 0).
std::vector<char> RigidVertices(const SpaceTimeMesh& mesh);

// Checks indices, finite numbers, array sizes and the invariant above (facets paired with opposite
// direction); the message names the first cell or facet at fault.  Errors: kInvalidArgument.
// Cost: O(cells log cells).
absl::Status Validate(const SpaceTimeMesh& mesh);

}  // namespace liquidblend::mesh
