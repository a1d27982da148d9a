#include "worker/registration/features/parts.h"

#include <gmock/gmock.h>

#include <numbers>

#include "tests/worker/registration/registration_testing.h"

namespace liquidblend::registration {
namespace {

using ::testing::ElementsAre;

TEST(Parts, ABallIsOnePartPerSlabWithItsVolumeAndPlace) {
  const TestSurface ball(SphereMesh());
  const PartGraph graph = FindParts(ball.surface);
  ASSERT_EQ(graph.parts.size(), 9u) << "7 between frames, 2 at the ends";
  ASSERT_EQ(graph.links.size(), 8u);
  const double edge = ball.mesh.edge_length_m;
  for (size_t n = 1; n + 1 < graph.parts.size(); ++n) {
    const Part& part = graph.parts[n];
    EXPECT_EQ(part.slab, static_cast<int>(n));
    const double time = part.centre[3];
    EXPECT_NEAR(time, part.slab - 0.5, 0.1);
    EXPECT_NEAR(part.centre[0] * edge, time / 24, 0.1 * edge);
    EXPECT_NEAR(part.centre[1], 0, 0.1);
    EXPECT_NEAR(part.volume * std::pow(edge, 3), 4.0 / 3 * std::numbers::pi * 0.125, 0.02);
    for (const double reach : part.reach) EXPECT_NEAR(reach * edge, 0.5, 0.5 * edge);
    EXPECT_EQ(graph.links[n], (PartLink{static_cast<int32_t>(n), static_cast<int32_t>(n) + 1}));
  }
}

TEST(Parts, DropletsCarriedAsRigidPiecesAreLeftOut) {
  const TestSurface with(BuildMesh(BlockAndDroplet(1.0f), kDropletVertices));
  ASSERT_FALSE(with.mesh.rigid_pieces.empty());
  const TestSurface without(BuildMesh(BlockAndDroplet(1.0f)));
  EXPECT_EQ(FindParts(with.surface).parts.size() * 2, FindParts(without.surface).parts.size());
}

}  // namespace
}  // namespace liquidblend::registration
