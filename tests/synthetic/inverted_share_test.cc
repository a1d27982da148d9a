#include "tests/synthetic/inverted_share.h"

#include <gtest/gtest.h>

#include "tests/synthetic/shapes.h"

namespace liquidblend::synthetic {
namespace {

constexpr double kSpacing = 0.05;

mesh::TriangleMesh Sphere(float x, double radius_m) { return Icosphere({x, 0, 0}, radius_m, 3); }

TEST(InvertedShare, OfASphereIsZero) {
  const CrossingCount count = CountInverted(Sphere(0, 1), kSpacing);
  // Two for each ray through one of the two discs.
  const double expected = 2 * 2 * M_PI / (kSpacing * kSpacing);
  EXPECT_NEAR(static_cast<double>(count.num_crossings) / expected, 1.0, 0.02);
  EXPECT_EQ(count.num_inverted, 0);
}

TEST(InvertedShare, OfASphereInsideOutIsOne) {
  EXPECT_EQ(CountInverted(Flipped(Sphere(0, 1)), kSpacing).inverted_share(), 1.0);
}

TEST(InvertedShare, OfOverlappingAndOfNestedSpheresIsZero) {
  const mesh::TriangleMesh overlapping[] = {Sphere(0, 1), Sphere(0.7f, 1)};
  const mesh::TriangleMesh nested[] = {Sphere(0, 1), Sphere(0, 0.5)};
  EXPECT_EQ(CountInverted(Join(overlapping), kSpacing).num_inverted, 0);
  EXPECT_EQ(CountInverted(Join(nested), kSpacing).num_inverted, 0);
}

TEST(InvertedShare, OfABubbleIsZero) {
  EXPECT_EQ(CountInverted(BallWithBubble({0, 0, 0}, 1, 0.5, 3), kSpacing).num_inverted, 0);
}

TEST(InvertedShare, IsThatOfThePartThatIsInsideOut) {
  const mesh::TriangleMesh parts[] = {Sphere(0, 1), Flipped(Icosphere({0, 0, 3}, 0.5, 3))};
  // Rays along x: the parts' discs are as 1 to 1/4. Rays along z leave the good sphere before they
  // meet the other one: the same.
  EXPECT_NEAR(CountInverted(Join(parts), kSpacing).inverted_share(), 0.25 / 1.25, 0.01);
}

TEST(InvertedShare, OfNothingIsZero) {
  EXPECT_EQ(CountInverted({}, kSpacing).inverted_share(), 0.0);
}

}  // namespace
}  // namespace liquidblend::synthetic
