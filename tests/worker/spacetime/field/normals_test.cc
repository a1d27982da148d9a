#include "worker/spacetime/field/normals.h"

#include <gtest/gtest.h>

#include "tests/synthetic/families.h"

namespace liquidblend::spacetime {
namespace {

// Outward normal of the space-time cone of a growing sphere: (r^, -growth), in the metric where a
// frame is as long as edge_length_m.
void ExpectNormalsOfGrowingSphere(mesh::SpaceTimeMesh mesh, float growth_per_frame) {
  mesh.edge_length_m = 0.2;
  ComputeNormals(mesh, parallel::Arena(2));
  ASSERT_EQ(mesh.normals.cols(), mesh.num_vertices());
  for (int64_t v = mesh.num_first_vertices; v < mesh.num_vertices() - mesh.num_last_vertices; ++v) {
    Eigen::Vector4f expected;
    expected << mesh.vertices.col(v).head<3>().normalized(),
        -growth_per_frame / static_cast<float>(mesh.edge_length_m);
    expected.normalize();
    EXPECT_GT(mesh.normals.col(v).dot(expected), 0.97f) << "vertex " << v;
  }
}

TEST(ComputeNormals, PointOutOfAGrowingSphereOfEachCellKind) {
  synthetic::ComplexOptions options;
  options.growth_per_frame = 0.1f;
  ExpectNormalsOfGrowingSphere(synthetic::HexahedralSphere(8, options), 0.1f);
  ExpectNormalsOfGrowingSphere(synthetic::WedgeSphere(3, options), 0.1f);
  ExpectNormalsOfGrowingSphere(synthetic::TetrahedralSphere(3, options), 0.1f);
  ExpectNormalsOfGrowingSphere(synthetic::MixedSphere(8, options), 0.1f);
}

}  // namespace
}  // namespace liquidblend::spacetime
