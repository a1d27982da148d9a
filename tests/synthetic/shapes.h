// Closed, oriented meshes and animations whose volume, topology and motion are known exactly.
#pragma once

#include <Eigen/Core>
#include <span>

#include "core/mesh/animation.h"
#include "core/mesh/triangle_mesh.h"

namespace liquidblend::synthetic {

// Subdivided icosahedron, outward: 20 * 4^subdivisions triangles, vertices on the sphere.
mesh::TriangleMesh Icosphere(const Eigen::Vector3f& centre_m, double radius_m, int subdivisions);

// Axis-parallel box, outward: 12 * cells_per_side^2 triangles.
mesh::TriangleMesh Box(const Eigen::Vector3f& min_m, const Eigen::Vector3f& max_m,
                       int cells_per_side = 1);

// Torus around the z axis, outward, genus 1: 2 * num_major * num_minor triangles.
mesh::TriangleMesh Torus(const Eigen::Vector3f& centre_m, double major_radius_m,
                         double minor_radius_m, int num_major, int num_minor);

// The same surface, inside out.
mesh::TriangleMesh Flipped(mesh::TriangleMesh mesh);

// All parts in one mesh; velocities are kept if every part has them.
mesh::TriangleMesh Join(std::span<const mesh::TriangleMesh> parts);

// A ball with a concentric air bubble: two components, volume 4/3 pi (outer^3 - bubble^3).
mesh::TriangleMesh BallWithBubble(const Eigen::Vector3f& centre_m, double outer_radius_m,
                                  double bubble_radius_m, int subdivisions);

// Three corners of its own for each triangle: closed only after welding.
mesh::TriangleMesh Soup(const mesh::TriangleMesh& mesh);

struct MovingSphereOptions {
  Eigen::Vector3f centre_m = {0, 0, 0};  // at frame 0
  Eigen::Vector3f velocity_m_per_s = {1, 0, 0};
  double radius_m = 0.5;          // > 0; at frame 0
  double growth_m_per_s = 0.0;    // of the radius, which must stay > 0
  double frames_per_second = 24;  // > 0
  int num_frames = 8;             // >= 1
  int subdivisions = 3;           // >= 0
};

// An icosphere that moves and grows steadily. Frames share connectivity; velocities are exact.
mesh::Animation MovingSphere(const MovingSphereOptions& options = {});

}  // namespace liquidblend::synthetic
