// A small surface with all that registration needs of it.
#pragma once

#include <gtest/gtest.h>

#include "tests/synthetic/implicit.h"
#include "tests/synthetic/shapes.h"
#include "worker/registration/fit/match.h"
#include "worker/spacetime/build.h"

namespace liquidblend::registration {

// The drops of the tests are small: only those that are asked for are carried as droplets.
inline mesh::SpaceTimeMesh BuildMesh(const mesh::Animation& animation,
                                     double droplet_vertices = 0) {
  spacetime::BuildOptions options;
  options.droplet_vertices = droplet_vertices;
  options.connectivity = spacetime::Connectivity::kRebuilt;
  auto mesh = spacetime::Build(animation, options, parallel::Arena(2));
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  return *std::move(mesh);
}

// A sphere that moves along x; starts at offset_m.
inline mesh::SpaceTimeMesh SphereMesh(const Eigen::Vector3f& offset_m = Eigen::Vector3f::Zero()) {
  synthetic::MovingSphereOptions options;
  options.centre_m = offset_m;
  return BuildMesh(synthetic::MovingSphere(options));
}

constexpr double kDropletVertices = 150;  // BlockAndDroplet's droplet has fewer

// A block of liquid with its top at top_m, and a droplet that falls beside it.
inline mesh::Animation BlockAndDroplet(float top_m) {
  mesh::Animation animation;
  for (int k = 0; k < 6; ++k) {
    const float z = 0.5f - 0.1f * static_cast<float>(k);
    mesh::TriangleMesh block = synthetic::Box({-1, -1, -1}, {1, 1, top_m}, 16);
    mesh::TriangleMesh droplet = synthetic::Icosphere({0, 1.4f, z}, 0.15, 1);
    block.velocities = Eigen::Matrix3Xf::Zero(3, block.num_vertices());
    droplet.velocities = Eigen::Vector3f(0, 0, -24 * 0.1f).replicate(1, droplet.num_vertices());
    const mesh::TriangleMesh parts[] = {block, droplet};
    animation.frames.push_back(synthetic::Join(parts));
  }
  return animation;
}

struct TestSurface {
  explicit TestSurface(mesh::SpaceTimeMesh space_time_mesh)
      : mesh(std::move(space_time_mesh)),
        surface(mesh, mesh.edge_length_m, parallel::Arena(2)),
        neighbors(VertexNeighbors(mesh, surface.cells_around, parallel::Arena(2))) {}
  TestSurface(const TestSurface&) = delete;
  TestSurface& operator=(const TestSurface&) = delete;
  mesh::SpaceTimeMesh mesh;
  Surface surface;
  PackedLists neighbors;
};

}  // namespace liquidblend::registration
