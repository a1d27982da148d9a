// Animations and meshes whose up is z, turned until another direction is up.
#pragma once

#include <Eigen/Core>
#include <utility>

#include "core/mesh/animation.h"
#include "core/mesh/space_time_mesh.h"
#include "core/mesh/up.h"

namespace liquidblend::synthetic {

// Rotation that takes z to `up`: a permutation of the axes with signs, so it is exact.
inline Eigen::Matrix3f TurnTo(mesh::Up up) {
  const mesh::HeightAxis height = mesh::AxisOf(up);
  Eigen::Matrix3f turn = Eigen::Matrix3f::Zero();
  turn((height.axis + 1) % 3, 0) = 1;
  turn((height.axis + 2) % 3, 1) = static_cast<float>(height.sign);
  turn(height.axis, 2) = static_cast<float>(height.sign);
  return turn;
}

inline mesh::TriangleMesh Turned(mesh::TriangleMesh mesh, mesh::Up up) {
  const Eigen::Matrix3f turn = TurnTo(up);
  mesh.vertices = (turn * mesh.vertices).eval();
  mesh.velocities = (turn * mesh.velocities).eval();
  mesh.normals = (turn * mesh.normals).eval();
  return mesh;
}

// Animation::up stays as it is.
inline mesh::Animation Turned(mesh::Animation animation, mesh::Up up) {
  for (mesh::TriangleMesh& frame : animation.frames) frame = Turned(std::move(frame), up);
  return animation;
}

// SpaceTimeMesh::up is set.
inline mesh::SpaceTimeMesh Turned(mesh::SpaceTimeMesh mesh, mesh::Up up) {
  const Eigen::Matrix3f turn = TurnTo(up);
  mesh.vertices.topRows<3>() = (turn * mesh.vertices.topRows<3>()).eval();
  mesh.normals.topRows<3>() = (turn * mesh.normals.topRows<3>()).eval();
  mesh.velocities = (turn * mesh.velocities).eval();
  mesh.up = up;
  return mesh;
}

}  // namespace liquidblend::synthetic
