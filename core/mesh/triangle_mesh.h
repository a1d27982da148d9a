// A triangle surface in space.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"

namespace liquidblend::mesh {

// A triangle mesh: vertices and triangles, a column each. Triangles are counter-clockwise seen from
// outside.
struct TriangleMesh {
  Eigen::Matrix3Xf vertices;    // 3 x num_vertices, metres
  Eigen::Matrix3Xi triangles;   // 3 x num_triangles, vertex indices
  Eigen::Matrix3Xf velocities;  // 3 x num_vertices, metres per second; or no columns: not known
  Eigen::Matrix3Xf normals;     // 3 x num_vertices, unit length, outward; or no columns: not known
  // 4 x num_vertices, places in the source: x, y, z in metres, seconds since its first frame; or no
  // columns: not known.
  Eigen::Matrix4Xf rest;

  int64_t num_vertices() const { return vertices.cols(); }
  int64_t num_triangles() const { return triangles.cols(); }
};

// Counts of the edges at which a triangle mesh is not closed, not oriented or not a manifold. The
// first two are 0 for the boundary of a solid, all three if it is a manifold along its edges.
struct ClosednessReport {
  int64_t num_odd_edges = 0;           // edges with an odd number of triangles
  int64_t num_misoriented_edges = 0;   // edges run through more often in one direction
  int64_t num_non_manifold_edges = 0;  // edges of four triangles or more: parts that touch there
  bool closed() const { return num_odd_edges == 0 && num_misoriented_edges == 0; }
};

// Counts those edges.  Requires: indices in range.  Cost: O(n log n).
ClosednessReport CheckClosed(const TriangleMesh& mesh);

// Checks that numbers are finite, indices in range and the counts of velocities and normals right;
// the message names the first offending element, vertices counted from `first_vertex`.
// Errors: kInvalidArgument.
absl::Status Validate(const TriangleMesh& mesh, int first_vertex = 0);

// Signed volume in cubic metres, positive for an outward orientation. Requires: closed().
double Volume(const TriangleMesh& mesh);

// Mean length of the edges, each triangle side counted once per triangle; 0 without triangles.
double MeanEdgeLength(const TriangleMesh& mesh);

// For each vertex, the lowest vertex of its component; a vertex that no triangle uses is its own
// component.
std::vector<int32_t> ComponentRoots(const TriangleMesh& mesh);

// Number of parts that are connected through triangles.
int64_t NumComponents(const TriangleMesh& mesh);

// Signed volumes of the connected parts, cubic metres, the largest first; volumes of bubbles are
// negative.
std::vector<double> ComponentVolumes(const TriangleMesh& mesh);

}  // namespace liquidblend::mesh
