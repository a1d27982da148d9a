#include "worker/spacetime/report.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/synthetic/shapes.h"

namespace liquidblend::spacetime {
namespace {

struct Built {
  mesh::SpaceTimeMesh mesh;
  mesh::SpaceTimeReport report;
};

Built BuildAndReport(const mesh::Animation& animation, Connectivity connectivity) {
  const parallel::Arena arena(2);
  BuildOptions options;
  options.connectivity = connectivity;
  auto mesh = Build(animation, options, arena);
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  Built built = {*std::move(mesh), {}};
  built.report = Report(animation, built.mesh, options, arena);
  return built;
}

// A sphere and a ball of 42 vertices that is a droplet.
mesh::Animation SphereAndDroplet() {
  mesh::Animation animation = synthetic::MovingSphere();
  for (mesh::TriangleMesh& frame : animation.frames) {
    mesh::TriangleMesh droplet = synthetic::Icosphere({0, 1, 0}, 0.15, 1);
    droplet.velocities = Eigen::Matrix3Xf::Zero(3, droplet.num_vertices());
    const mesh::TriangleMesh parts[] = {frame, droplet};
    frame = synthetic::Join(parts);
  }
  return animation;
}

TEST(Report, CountsWhatIsInARebuiltMesh) {
  const auto [mesh, report] = BuildAndReport(SphereAndDroplet(), Connectivity::kRebuilt);
  EXPECT_FALSE(report.is_tracked);
  EXPECT_DOUBLE_EQ(report.grid_spacing_m, 0.9 * mesh.edge_length_m);
  EXPECT_EQ(report.edge_length_m, mesh.edge_length_m);
  EXPECT_EQ(report.num_vertices, mesh.num_vertices());
  EXPECT_GT(report.num_hexahedra, 0);
  EXPECT_GT(report.num_wedges, 0);  // the droplet's
  EXPECT_EQ(report.num_hexahedra + report.num_wedges + report.num_tetrahedra + report.num_pyramids,
            mesh.num_cells());
  EXPECT_EQ(report.num_droplets, 1);
  EXPECT_EQ(report.num_rigid_pieces, static_cast<int64_t>(mesh.rigid_pieces.size()));
  EXPECT_EQ(report.fidelity.num_components_shown, 2 * report.fidelity.num_frames);
  EXPECT_LT(report.fidelity.mean_distance_edges, 0.05);
}

TEST(Report, ATrackedMeshHasNoGrid) {
  const auto [mesh, report] = BuildAndReport(synthetic::MovingSphere(), Connectivity::kTracked);
  EXPECT_TRUE(report.is_tracked);
  EXPECT_EQ(report.grid_spacing_m, 0.0);
  EXPECT_EQ(report.num_wedges, mesh.num_cells());
  EXPECT_EQ(report.num_droplets, 0);
  EXPECT_EQ(report.thin_share, 0.0);
  EXPECT_LT(report.fidelity.max_distance_edges, 1e-5);
}

TEST(Report, TellsTheShareOfThinVertices) {
  mesh::Animation slab;
  slab.frames.assign(3, synthetic::Box({-1, -1, -0.02F}, {1, 1, 0.02F}, 20));
  const auto [mesh, report] = BuildAndReport(slab, Connectivity::kTracked);
  const auto num_thin = std::count(mesh.thin.begin(), mesh.thin.end(), 1);
  EXPECT_EQ(report.thin_share,
            static_cast<double>(num_thin) / static_cast<double>(mesh.num_vertices()));
  EXPECT_GT(report.thin_share, 0.25);  // the rest is on the rim, whose triangles are smaller
  EXPECT_LT(report.thin_share, 1.0);
}

}  // namespace
}  // namespace liquidblend::spacetime
