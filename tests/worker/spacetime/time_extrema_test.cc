#include "worker/spacetime/time_extrema.h"

#include <gtest/gtest.h>

#include <array>

namespace liquidblend::spacetime {
namespace {

// One hexahedron; its corners in slab `slab` of three, which are a frame long and begin at -1.
struct Scene {
  Layers layers;
  std::vector<int64_t> first_vertex;
  mesh::SpaceTimeMesh mesh;
};

Scene OneCell(const std::array<int, 8>& slab, const std::array<float, 8>& time) {
  Scene scene;
  scene.layers.plan.layers.resize(4);
  scene.layers.plan.first_layer = {0, 1, 2, 3};
  for (int l = 0; l < 4; ++l) scene.layers.plan.layers[l].time = l - 1.0;
  scene.layers.slabs.resize(3);
  scene.mesh.vertices = Eigen::Matrix4Xf::Zero(4, 8);
  mesh::Hexahedron& cell = scene.mesh.hexahedra.emplace_back();
  int next = 0;
  for (int s = 0; s < 3; ++s) {
    scene.first_vertex.push_back(next);
    for (int c = 0; c < 8; ++c) {
      if (slab[c] != s) continue;
      Slab& added_to = scene.layers.slabs[s];
      const auto vertex = static_cast<int32_t>(added_to.num_vertices());
      added_to.cells.push_back({vertex, vertex, 1, 0, 1, 1, false});
      added_to.vertices.push_back({0, 0, 0, time[c] - static_cast<float>(s - 1)});
      scene.mesh.vertices(3, next) = time[c];
      cell[c] = next++;
    }
  }
  scene.first_vertex.push_back(next);
  return scene;
}

float TimeOf(const Scene& scene, int corner) {
  return scene.mesh.vertices(3, scene.mesh.hexahedra[0][corner]);
}

TEST(FlattenTimeExtrema, ASingleEarlyOrLateVertexJoinsItsNeighbours) {
  for (const float time : {0.1F, 0.9F}) {
    Scene scene =
        OneCell({1, 1, 1, 1, 1, 1, 1, 1}, {time, 0.5F, 0.5F, 0.5F, 0.5F, 0.5F, 0.5F, 0.5F});
    FlattenTimeExtrema(scene.layers, scene.first_vertex, scene.mesh);
    for (int c = 0; c < 8; ++c) EXPECT_FLOAT_EQ(TimeOf(scene, c), 0.5F) << c;
  }
}

TEST(FlattenTimeExtrema, AVertexThatIsBetweenItsNeighboursStays) {
  Scene scene = OneCell({1, 1, 1, 1, 1, 1, 1, 1}, {0.4F, 0.3F, 0.3F, 0.3F, 0.6F, 0.4F, 0.4F, 0.6F});
  FlattenTimeExtrema(scene.layers, scene.first_vertex, scene.mesh);
  EXPECT_FLOAT_EQ(TimeOf(scene, 0), 0.4F);
}

TEST(FlattenTimeExtrema, NoneLeavesItsSlabOrAnEndSlab) {
  // Corner 0 would go to 1.2, into slab 2; corner 7, of the last slab, is later than all others.
  Scene scene = OneCell({1, 2, 2, 2, 2, 2, 2, 2}, {0.5F, 1.2F, 1.2F, 1.2F, 1.2F, 1.2F, 1.2F, 1.9F});
  FlattenTimeExtrema(scene.layers, scene.first_vertex, scene.mesh);
  EXPECT_FLOAT_EQ(TimeOf(scene, 0), 0.95F);
  EXPECT_FLOAT_EQ(TimeOf(scene, 7), 1.9F);
}

}  // namespace
}  // namespace liquidblend::spacetime
