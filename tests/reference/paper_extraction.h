// The paper's own surface extraction (section 8 and appendix), to compare ours with: wedges are cut
// into tetrahedra, tetrahedra into triangles, holes closed by fans, slivers evened out.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/mesh/space_time_mesh.h"
#include "core/mesh/triangle_mesh.h"

namespace liquidblend::reference {

// Three tetrahedra for each wedge. The vertex numbers of the earlier triangle are the labels: each
// of its edges points to the higher label, and the diagonal of the quad above it ends there. No
// three edges point round in a circle, so all prisms are of the paper's type 1.
std::vector<mesh::Tetrahedron> SplitWedges(const std::vector<mesh::Wedge>& wedges);

// Cuts tetrahedra at t = time_frames: one triangle, or two, each. Not closed where wedges are
// missing.
mesh::TriangleMesh SliceTetrahedra(const Eigen::Matrix4Xf& vertices,
                                   const std::vector<mesh::Tetrahedron>& tetrahedra,
                                   double time_frames);

// A vertex at the centroid of each hole's vertices, and a fan of triangles from it.
void FillHoles(mesh::TriangleMesh& surface);

// Moves each vertex by half of the way to the mean of its neighbours.
void SmoothOnce(mesh::TriangleMesh& surface);

// All of section 8: slice, holes, one step of Laplacian smoothing.
mesh::TriangleMesh ExtractAsInThePaper(const Eigen::Matrix4Xf& vertices,
                                       const std::vector<mesh::Tetrahedron>& tetrahedra,
                                       double time_frames);

// Twice the radius of the inscribed by that of the circumscribed circle: 1 for an equilateral
// triangle, 0 without area.
double RadiusRatio(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c);

// Triangles with a radius ratio below 0.1.
int64_t NumSlivers(const mesh::TriangleMesh& surface);

}  // namespace liquidblend::reference
