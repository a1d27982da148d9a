#include "core/finish/time_links.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <span>

#include "core/mesh/registered_family.h"
#include "tests/synthetic/families.h"

namespace liquidblend::finish {
namespace {

using testing::AllOf;
using testing::Each;
using testing::SizeIs;

// Layers of equally many vertices: each is linked to its own place in the next layer.
void ExpectLinksToTheNextLayer(const mesh::SpaceTimeMesh& mesh, const char* what) {
  const mesh::RegisteredFamily family = mesh::ViewOf(mesh);
  const TimeLinks links(family);
  const auto layer = static_cast<int32_t>(mesh.num_first_vertices);
  const auto count = static_cast<int32_t>(mesh.num_vertices());
  ASSERT_GT(layer, 0) << what;
  ASSERT_GT(count, layer) << what;
  for (int32_t v = 0; v < count; ++v) {
    EXPECT_EQ(links.earlier()[v], v < layer ? -1 : v - layer) << what << ", vertex " << v;
    EXPECT_EQ(links.later()[v], v + layer < count ? v + layer : -1) << what << ", vertex " << v;
  }
}

TEST(TimeLinks, RunAlongThePrismsOfAMovingSurface) {
  synthetic::ComplexOptions options;
  options.velocity_m_per_frame = {0.3F, 0.1F, 0};
  ExpectLinksToTheNextLayer(synthetic::HexahedralSphere(5, options), "hexahedra");
  ExpectLinksToTheNextLayer(synthetic::WedgeSphere(1, options), "wedges");
}

TEST(TimeLinks, ConesHaveNone) {
  const mesh::SpaceTimeMesh mesh = synthetic::TetrahedralSphere(1);
  const TimeLinks links(mesh::ViewOf(mesh));
  ASSERT_GT(mesh.num_vertices(), 0);
  EXPECT_THAT(links.earlier(), AllOf(SizeIs(mesh.num_vertices()), Each(-1)));
  EXPECT_THAT(links.later(), AllOf(SizeIs(mesh.num_vertices()), Each(-1)));
}

TEST(TimeLinks, CellsThatAreFlatInTimeHaveNone) {
  mesh::SpaceTimeMesh mesh;
  mesh.vertices.resize(4, 8);
  for (int k = 0; k < 8; ++k) {
    mesh.vertices.col(k) =
        Eigen::Vector4f(static_cast<float>(k & 1), static_cast<float>(k >> 1 & 1),
                        static_cast<float>(k >> 2), k % 3 == 0 ? 0.9F : 0.1F);
  }
  mesh.hexahedra = {{0, 1, 2, 3, 4, 5, 6, 7}};
  const TimeLinks links(mesh::ViewOf(mesh));
  EXPECT_THAT(links.later(), AllOf(SizeIs(8), Each(-1)));
}

}  // namespace
}  // namespace liquidblend::finish
