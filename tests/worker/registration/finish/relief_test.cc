#include "worker/registration/finish/relief.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "tests/worker/registration/registration_testing.h"

namespace liquidblend::registration {
namespace {

constexpr double kEdge_m = 0.1;
constexpr double kRadius_m = 0.3;
constexpr double kDepth_m = 0.4;

struct Crater {
  double x = 0.0;  // m
  double depth = kDepth_m;
};

// A pool of which the top is at z = 0, with craters.
mesh::TriangleMesh Pool(const std::vector<Crater>& craters) {
  const synthetic::GridBox box = {
      .min_m = {-1.7f, -0.9f, -0.8f}, .max_m = {1.7f, 0.9f, 0.8f}, .spacing_m = kEdge_m};
  return synthetic::Polygonize(
      [&](const Eigen::Vector3d& p) {
        double top = 0;
        for (const Crater& crater : craters) {
          const double r = std::hypot(p[0] - crater.x, p[1]) / kRadius_m;
          top -= crater.depth * std::exp(-r * r);
        }
        const double sides = std::max(std::abs(p[0]) - 1.57, std::abs(p[1]) - 0.77);
        return std::max({sides, -0.68 - p[2], p[2] - top});
      },
      box);
}

ReliefLoss Loss(const std::vector<mesh::TriangleMesh>& source,
                const std::vector<mesh::TriangleMesh>& target,
                const std::vector<mesh::TriangleMesh>& half_way, mesh::Up up = mesh::Up::kZ) {
  return LossOfRelief(source, target, {{0.5, half_way}}, up, kEdge_m, parallel::Arena(2));
}

TEST(LossOfRelief, OfACraterThatMovesIsNone) {
  const ReliefLoss loss = Loss({Pool({{-0.7}})}, {Pool({{0.7}})}, {Pool({{0.0}})});
  EXPECT_NEAR(loss.share, 0, 0.02);
}

TEST(LossOfRelief, OfTwoCratersInPlaceOfOneIsAboutAThird) {
  const ReliefLoss loss = Loss({Pool({})}, {Pool({})}, {Pool({})});
  EXPECT_EQ(loss.share, 0);
  const ReliefLoss faded = Loss({Pool({}), Pool({{-0.7}})}, {Pool({}), Pool({{0.7}})},
                                {Pool({}), Pool({{-0.7, kDepth_m / 2}, {0.7, kDepth_m / 2}})});
  EXPECT_NEAR(faded.share, 1 - std::sqrt(0.5), 0.06);
  EXPECT_EQ(faded.slice, 1);
  EXPECT_NEAR(faded.source_m.x(), -0.7, 0.05);
  EXPECT_NEAR(faded.source_m.y(), 0, 0.05);
  EXPECT_NEAR(faded.source_m.z(), 0, 0.05);
  EXPECT_NEAR(faded.target_m.x(), 0.7, 0.05);
}

TEST(LossOfRelief, OfACraterHalfAsDeepAsTheMeanOfBothIsHalf) {
  EXPECT_NEAR(Loss({Pool({{0, 0.2}})}, {Pool({{0, 0.4}})}, {Pool({{0, 0.3}})}).share, 0, 0.02);
  EXPECT_NEAR(Loss({Pool({{0, 0.4}})}, {Pool({{0, 0.4}})}, {Pool({{0, 0.2}})}).share, 0.5, 0.03);
  EXPECT_EQ(Loss({Pool({{0, 0.2}})}, {Pool({{0, 0.2}})}, {Pool({{0, 0.4}})}).share, 0);
}

// Events that come at another time half-way: all slices count together.
TEST(LossOfRelief, OfACraterAtAnotherTimeIsNone) {
  const mesh::TriangleMesh still = Pool({}), crater = Pool({{}});
  const ReliefLoss loss =
      Loss({crater, still, still}, {still, still, crater}, {still, crater, still});
  EXPECT_NEAR(loss.share, 0, 1e-9);
}

// A tall block on the left, one on the right, and half-way a flat one over both.
TEST(LossOfRelief, CountsWhereThereIsNoLiquidAsTheLowestHeight) {
  const auto step = [](float left, float right) {
    const mesh::TriangleMesh parts[] = {synthetic::Box({-1, -0.5F, 0}, {0, 0.5F, left}, 8),
                                        synthetic::Box({0.01F, -0.5F, 0}, {1, 0.5F, right}, 8)};
    return synthetic::Join(parts);
  };
  EXPECT_NEAR(Loss({step(1, 0.5F)}, {step(0.5F, 1)}, {step(0.75F, 0.75F)}).share, 1, 0.02);
  const mesh::TriangleMesh left = synthetic::Box({-1, -0.5F, 0}, {0, 0.5F, 1}, 8);
  const mesh::TriangleMesh right = synthetic::Box({0, -0.5F, 0}, {1, 0.5F, 1}, 8);
  EXPECT_EQ(Loss({left}, {right}, {right}).share, 0) << "no height but the blocks'";
}

TEST(LossOfRelief, DoesNotSeeDrops) {
  const mesh::TriangleMesh parts[] = {Pool({}), synthetic::Icosphere({0, 0, 0.5F}, 0.2, 2)};
  const mesh::TriangleMesh with_drop = synthetic::Join(parts);
  EXPECT_EQ(Loss({with_drop}, {with_drop}, {Pool({})}).share, 0);
}

// The grid of heights has a limit.
TEST(LossOfRelief, OfSurfacesFarApartTakesNoMoreTimeThanOfOthers) {
  mesh::TriangleMesh far = Pool({{}});
  far.vertices.row(0).array() += 1e5F;
  EXPECT_GE(Loss({Pool({{}})}, {far}, {Pool({{}})}).share, 0);
}

TEST(LossOfRelief, LooksFromWhereUpIs) {
  const auto turned = [](mesh::TriangleMesh surface) {
    const Eigen::Matrix3Xf before = surface.vertices;
    surface.vertices.row(0) = before.row(2);
    surface.vertices.row(1) = before.row(0);
    surface.vertices.row(2) = before.row(1);
    return surface;
  };
  const ReliefLoss loss = Loss({turned(Pool({{-0.7}}))}, {turned(Pool({{0.7}}))},
                               {turned(Pool({{-0.7, 0.2}, {0.7, 0.2}}))}, mesh::Up::kX);
  EXPECT_NEAR(loss.share, 1 - std::sqrt(0.5), 0.06);
  EXPECT_NEAR(loss.source_m.y(), -0.7, 0.05);
}

TEST(LossOfRelief, OfNothingIsNone) {
  EXPECT_EQ(Loss({{}}, {{}}, {{}}).share, 0);
  EXPECT_EQ(Loss({Pool({{}})}, {Pool({{}})}, {{}}).share, 1);
}

}  // namespace
}  // namespace liquidblend::registration
