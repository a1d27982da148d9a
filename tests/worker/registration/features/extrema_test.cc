#include "worker/registration/features/extrema.h"

#include <gmock/gmock.h>

#include <cmath>
#include <functional>

#include "tests/synthetic/turned.h"
#include "tests/worker/registration/registration_testing.h"

namespace liquidblend::registration::extrema_test {
namespace {

constexpr int kNumFrames = 17;
constexpr double kPeakFrame = 8;

// Height of a pool's surface at x, y (m) and a frame.
using Height = std::function<double(double, double, double)>;

mesh::SpaceTimeMesh Pool(const Height& height) {
  mesh::Animation animation;
  const synthetic::GridBox box = {.min_m = {-1, -1, -0.8f}, .max_m = {1, 1, 1}, .spacing_m = 0.1};
  for (int k = 0; k < kNumFrames; ++k) {
    animation.frames.push_back(synthetic::Polygonize(
        [&](const Eigen::Vector3d& p) {
          const double sides = std::max(std::abs(p[0]), std::abs(p[1])) - 0.8;
          return std::max({sides, -0.7 - p[2], p[2] - height(p[0], p[1], k)});
        },
        box));
  }
  return BuildMesh(animation);
}

// A bump (a dent if height_m < 0) that comes and goes.
Height Bump(double height_m) {
  return [=](double x, double y, double frame) {
    const double distance_sq = ((x - 0.2) * (x - 0.2) + y * y) / 0.1;
    const double time_sq = (frame - kPeakFrame) * (frame - kPeakFrame) / 12;
    return height_m * std::exp(-distance_sq - time_sq);
  };
}

void ExpectAtBump(const Extremum& extremum, double height_m, double edge) {
  const Eigen::Vector3d place = edge * extremum.point.head<3>();
  EXPECT_LT((place - Eigen::Vector3d(0.2, 0, height_m)).norm(), 1.5 * edge);
  EXPECT_NEAR(extremum.point[3], kPeakFrame, 1);
  EXPECT_NEAR(extremum.persistence * edge, std::abs(height_m), 1.5 * edge);
}

TEST(Extrema, AJetHasOneApexInSpaceAndTime) {
  const TestSurface test(Pool(Bump(0.6)));
  const std::vector<Extremum> found = FindExtrema(test.surface);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].kind, ExtremumKind::kApex);
  const double edge = test.mesh.edge_length_m;
  const Eigen::Vector3d place = edge * found[0].point.head<3>();
  EXPECT_LT((place - Eigen::Vector3d(0.2, 0, 0.6)).norm(), 1.5 * edge);
  EXPECT_NEAR(found[0].point[3], kPeakFrame, 1);
}

TEST(Extrema, ACraterHasOneBottomInSpaceAndTime) {
  const TestSurface test(Pool(Bump(-0.5)));
  const std::vector<Extremum> found = FindExtrema(test.surface);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].kind, ExtremumKind::kCrater);
  ExpectAtBump(found[0], -0.5, test.mesh.edge_length_m);
}

TEST(Extrema, AreTheSameWhicheverWayIsUp) {
  for (const double height_m : {0.6, -0.5}) {
    const mesh::SpaceTimeMesh mesh = Pool(Bump(height_m));
    const std::vector<Extremum> expected = FindExtrema(TestSurface(mesh).surface);
    ASSERT_EQ(expected.size(), 1u);
    for (const mesh::Up up : {mesh::Up::kX, mesh::Up::kY, mesh::Up::kMinusZ}) {
      const TestSurface turned(synthetic::Turned(mesh, up));
      const std::vector<Extremum> found = FindExtrema(turned.surface);
      ASSERT_EQ(found.size(), 1u) << mesh::NameOf(up);
      EXPECT_EQ(found[0].kind, expected[0].kind);
      EXPECT_EQ(found[0].persistence, expected[0].persistence);
      Eigen::Vector4d point = expected[0].point;
      point.head<3>() = synthetic::TurnTo(up).cast<double>() * expected[0].point.head<3>();
      EXPECT_EQ(found[0].point, point) << mesh::NameOf(up);
    }
  }
}

TEST(Extrema, RipplesAndTheEndsOfTimeGiveNone) {
  const Height ripples = [](double x, double y, double frame) {
    return 0.05 * std::sin(9 * x + frame) * std::sin(11 * y - 0.7 * frame);
  };
  EXPECT_TRUE(FindExtrema(TestSurface(Pool(ripples)).surface).empty());
  const Height rising = [](double x, double y, double frame) {
    return 0.6 * frame / kNumFrames * std::exp(-(x * x + y * y) / 0.1);
  };
  EXPECT_TRUE(FindExtrema(TestSurface(Pool(rising)).surface).empty());
}

}  // namespace
}  // namespace liquidblend::registration::extrema_test
