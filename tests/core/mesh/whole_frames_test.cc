#include "core/mesh/whole_frames.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

namespace liquidblend::mesh {
namespace {

using testing::ElementsAre;

SpaceTimeMesh VerticesAt(const std::vector<float>& times, int num_frames) {
  SpaceTimeMesh mesh;
  mesh.num_frames = num_frames;
  mesh.vertices = Eigen::Matrix4Xf::Zero(4, static_cast<int64_t>(times.size()));
  for (size_t v = 0; v < times.size(); ++v) mesh.vertices(3, static_cast<int64_t>(v)) = times[v];
  return mesh;
}

TEST(WholeFrames, AreAllFramesWithoutGaps) {
  EXPECT_THAT(WholeFrames(VerticesAt({-0.5F, 0.5F, 1.5F, 2.5F, 3.5F}, 4)), ElementsAre(0, 1, 2, 3));
}

TEST(WholeFrames, DoNotFollowTheDuration) {
  constexpr int kNumFrames = std::numeric_limits<int>::max();
  EXPECT_THAT(WholeFrames(VerticesAt({-0.5F, 0.5F, 0.75F, 1000.5F, 3e9F}, kNumFrames)),
              ElementsAre(0, 1, 1000, 1001));
}

TEST(WholeFrames, AreThinnedBeyondALimit) {
  std::vector<float> times;
  for (int frame = 0; frame < 3 * kMostWholeFrames; ++frame) {
    times.push_back(0.5F + static_cast<float>(frame));
  }
  const std::vector<double> frames = WholeFrames(VerticesAt(times, 3 * kMostWholeFrames));
  EXPECT_EQ(frames.size(), kMostWholeFrames);
  EXPECT_EQ(frames.front(), 0);
  EXPECT_EQ(frames.back(), 3 * kMostWholeFrames - 1);
  EXPECT_TRUE(std::is_sorted(frames.begin(), frames.end()));
}

TEST(WholeFrames, ThereAreNoneWithoutVertices) {
  EXPECT_TRUE(WholeFrames(VerticesAt({}, 5)).empty());
}

}  // namespace
}  // namespace liquidblend::mesh
