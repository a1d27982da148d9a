#include "core/frames/grid.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/synthetic/families.h"

namespace liquidblend::frames {
namespace {

TEST(Grid, HoldsTheDomainAndTheSource) {
  mesh::RegisteredFamily family = synthetic::MakeFamily(synthetic::HexahedralSphere(4), {});
  family.domain_min = {-0.5F, -3.0F, -0.5F};
  family.domain_max = {0.5F, 0.5F, 0.5F};
  const Grid grid = GridOf(family);
  EXPECT_FLOAT_EQ(grid.origin[0], -1.0F);
  EXPECT_FLOAT_EQ(grid.origin[1], -3.0F);
  EXPECT_FLOAT_EQ(grid.origin[2], -1.0F);
  EXPECT_FLOAT_EQ(grid.extent_m, 4.0F);
  for (int k = 0; k < 3; ++k) EXPECT_GE(grid.origin[k] + grid.extent_m, family.domain_max[k]);
}

TEST(Grid, OfASinglePointHasAPositiveExtent) {
  const mesh::SpaceTimeMesh mesh;
  const Grid grid = GridOf(mesh::ViewOf(mesh));
  EXPECT_GT(grid.extent_m, 0.0F);
}

TEST(Grid, TheFewestBitsForAStepGiveStepsNoLonger) {
  Grid grid;
  grid.extent_m = 2.0F;
  EXPECT_EQ(BitsForStep(grid, 0.0002), 14);  // 0.122 mm; 13 bits: 0.244 mm
  for (int bits = kMinPositionBits; bits <= kMaxPositionBits; ++bits) {
    EXPECT_EQ(BitsForStep(grid, StepOf(grid, bits)), bits);
    if (bits < kMaxPositionBits) {
      EXPECT_EQ(BitsForStep(grid, StepOf(grid, bits) * (1 - 1e-12)), bits + 1);
    }
  }
  EXPECT_EQ(BitsForStep(grid, 1e9), kMinPositionBits);
  EXPECT_EQ(BitsForStep(grid, StepOf(grid, kMaxPositionBits) * (1 - 1e-12)), std::nullopt);
  EXPECT_EQ(BitsForStep(grid, NAN), std::nullopt);
}

}  // namespace
}  // namespace liquidblend::frames
