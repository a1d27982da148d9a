#include "tests/accuracy/distance_field_blend.h"

#include <gtest/gtest.h>

#include "tests/synthetic/shapes.h"

namespace liquidblend::accuracy {
namespace {

constexpr double kSpacing = 0.1;

TEST(BlendDistances, OfConcentricSpheresIsTheSphereBetween) {
  const mesh::TriangleMesh small = synthetic::Icosphere({0, 0, 0}, 0.6, 4),
                           large = synthetic::Icosphere({0, 0, 0}, 1.0, 4);
  const mesh::TriangleMesh blend = BlendDistances({&small, &large}, {0.25, 0.75}, kSpacing);
  EXPECT_TRUE(mesh::CheckClosed(blend).closed());
  const Eigen::VectorXf radii = blend.vertices.colwise().norm().transpose();
  // Linear interpolation of a distance that is curved over half a spacing.
  EXPECT_NEAR(radii.minCoeff(), 0.9, 0.01);
  EXPECT_NEAR(radii.maxCoeff(), 0.9, 0.01);
}

TEST(BlendDistances, LosesADropThatHasMoved) {
  const mesh::TriangleMesh left = synthetic::Icosphere({-1, 0, 0}, 0.5, 3),
                           right = synthetic::Icosphere({1, 0, 0}, 0.5, 3);
  EXPECT_EQ(BlendDistances({&left, &right}, {0.5, 0.5}, kSpacing).num_triangles(), 0);
}

TEST(SignedDistances, AreNegativeInsideOnly) {
  const mesh::TriangleMesh ball = synthetic::BallWithBubble({0, 0, 0}, 1, 0.5, 4);
  const Eigen::AlignedBox3f box(Eigen::Vector3f::Constant(-1.5f), Eigen::Vector3f::Constant(1.5f));
  const SignedDistances distances(ball, box, 0.25);
  EXPECT_NEAR(distances.At({6, 6, 6}), 0.5, 0.01);    // the bubble's centre
  EXPECT_NEAR(distances.At({9, 6, 6}), -0.25, 0.01);  // between the two
  EXPECT_NEAR(distances.At({12, 6, 6}), 0.5, 0.01);
}

}  // namespace
}  // namespace liquidblend::accuracy
