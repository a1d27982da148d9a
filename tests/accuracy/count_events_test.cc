#include "tests/accuracy/count_events.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/synthetic/implicit.h"

namespace liquidblend::accuracy {
namespace {

constexpr double kEdge = 0.1;
constexpr Frames kFrames = {.num = 4, .num_early = 3, .step = 1};

// A place where the pool's surface is lower, or higher, than z = 0.
struct Bump {
  double x = 0.0;
  double height_m = 0.0;
};

mesh::TriangleMesh Pool(const std::vector<Bump>& bumps) {
  const synthetic::GridBox box = {
      .min_m = {-2.2f, -1.2f, -1.2f}, .max_m = {2.2f, 1.2f, 1.2f}, .spacing_m = kEdge};
  return synthetic::Polygonize(
      [&](const Eigen::Vector3d& p) {
        double top = 0;
        for (const Bump& bump : bumps) {
          const double r = std::hypot(p[0] - bump.x, p[1]);
          top += bump.height_m * std::exp(-(r * r) / (0.3 * 0.3));
        }
        const double sides = std::max(std::abs(p[0]) - 2, std::abs(p[1]) - 1);
        return std::max({sides, -1 - p[2], p[2] - top});
      },
      box);
}

// Counts in the surfaces with these bumps in the second frame, and a still pool in the others.
EventCounts Count(const std::vector<Bump>& bumps) {
  const auto surface = [&](double frame) { return Pool(frame == 1 ? bumps : std::vector<Bump>()); };
  return CountEvents(surface, kFrames, mesh::Up::kZ, kEdge, parallel::Arena(2));
}

TEST(CountEvents, CountsCratersAndJets) {
  const EventCounts counts = Count({{-1, -0.6}, {0, 0.5}, {1, -0.5}});
  EXPECT_EQ(counts.craters, 2);
  EXPECT_EQ(counts.jets, 1);
}

TEST(CountEvents, LessThanHalfOfTheDeepestIsNone) {
  EXPECT_EQ(Count({{-1, -0.8}, {1, -0.3}}).craters, 1);
}

TEST(CountEvents, AStillPoolAndLowWavesHaveNone) {
  for (const double height_m : {0.0, 0.15}) {
    const EventCounts counts = Count({{0, height_m}});
    EXPECT_EQ(counts.craters, 0);
    EXPECT_EQ(counts.jets, 0);
  }
}

TEST(CountEvents, LateFramesDoNotCount) {
  const auto surface = [](double frame) {
    return Pool(frame >= kFrames.num_early ? std::vector<Bump>{{0, -0.6}} : std::vector<Bump>());
  };
  EXPECT_EQ(CountEvents(surface, kFrames, mesh::Up::kZ, kEdge, parallel::Arena(2)).craters, 0);
}

}  // namespace
}  // namespace liquidblend::accuracy
