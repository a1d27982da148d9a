#include "worker/spacetime/nets/droplets.h"

#include <gtest/gtest.h>

#include <array>
#include <numbers>

#include "tests/synthetic/shapes.h"

namespace liquidblend::spacetime::droplets_test {
namespace {

constexpr double kSmall = 1.0;  // m^2
constexpr double kStep = 1.0 / 24;

mesh::TriangleMesh Ball(const Eigen::Vector3f& centre, double radius,
                        const Eigen::Vector3f& velocity = {0, 0, 0}) {
  mesh::TriangleMesh ball = synthetic::Icosphere(centre, radius, 2);
  ball.velocities = velocity.replicate(1, ball.num_vertices());
  return ball;
}

mesh::TriangleMesh Frame(std::initializer_list<mesh::TriangleMesh> parts) {
  const std::vector<mesh::TriangleMesh> all(parts);
  return synthetic::Join(all);
}

TEST(SplitDroplets, LeavesAnAnimationWithoutDropletsAlone) {
  mesh::Animation animation;
  animation.frames.assign(3, Ball({0, 0, 0}, 1));
  const DropletSplit split = SplitDroplets(animation, kSmall);
  EXPECT_FALSE(split.rest.has_value());
  EXPECT_TRUE(split.tracks.empty());
}

TEST(SplitDroplets, FollowsTwoThatPassEachOther) {
  mesh::Animation animation;
  for (int k = 0; k < 5; ++k) {
    const float x = 0.3f * static_cast<float>(k);
    animation.frames.push_back(
        Frame({Ball({0, 0, -5}, 1), Ball({x, 0.05f, 0}, 0.1, {0.3f / kStep, 0, 0}),
               Ball({1.2f - x, -0.05f, 0}, 0.1, {-0.3f / kStep, 0, 0})}));
  }
  const DropletSplit split = SplitDroplets(animation, kSmall);
  ASSERT_EQ(split.tracks.size(), 2u);
  for (const DropletTrack& track : split.tracks) {
    ASSERT_EQ(track.droplets.size(), 5u);
    EXPECT_EQ(track.birth, -1);
    EXPECT_EQ(track.death, 5);
    for (const Droplet& droplet : track.droplets) {
      EXPECT_NEAR(droplet.centroid_m.y(), track.droplets[0].centroid_m.y(), 1e-6);
    }
  }
  ASSERT_TRUE(split.rest.has_value());
  for (const mesh::TriangleMesh& frame : split.rest->frames) {
    EXPECT_EQ(mesh::NumComponents(frame), 1);
    EXPECT_EQ(frame.velocities.cols(), frame.num_vertices());
  }
}

// The pool shows it before and after, so it is shown nearly until then.
TEST(SplitDroplets, StartsAndEndsWhereTheRestShowsIt) {
  mesh::Animation animation;
  animation.frames.assign(6, Ball({0, 0, -5}, 1));
  for (int k = 2; k < 4; ++k) {
    animation.frames[k] = Frame({Ball({0, 0, -5}, 1), Ball({0, 0, 0}, 0.1)});
  }
  const DropletSplit split = SplitDroplets(animation, kSmall);
  ASSERT_EQ(split.tracks.size(), 1u);
  EXPECT_NEAR(split.tracks[0].birth, 1.1, 1e-9);
  EXPECT_NEAR(split.tracks[0].death, 3.9, 1e-9);
}

TEST(SplitDroplets, MergesHalfway) {
  mesh::Animation animation;
  const mesh::TriangleMesh pool = Ball({0, 0, -5}, 1);
  animation.frames = {Frame({pool, Ball({-0.1f, 0, 0}, 0.12), Ball({0.12f, 0, 0}, 0.07)}),
                      Frame({pool, Ball({-0.05f, 0, 0}, 0.13)})};
  const DropletSplit split = SplitDroplets(animation, kSmall);
  ASSERT_EQ(split.tracks.size(), 2u);
  EXPECT_EQ(split.tracks[0].droplets.size(), 2u);
  EXPECT_EQ(split.tracks[1].droplets.size(), 1u);
  EXPECT_EQ(split.tracks[1].death, 0.5);
}

TEST(SplitDroplets, ABubbleIsNoDrop) {
  mesh::Animation animation;
  const mesh::TriangleMesh pool = Ball({0, 0, -5}, 1);
  animation.frames = {Frame({pool, Ball({0, 0, 0}, 0.1)}),
                      Frame({pool, synthetic::Flipped(Ball({0, 0, 0}, 0.1))})};
  const DropletSplit split = SplitDroplets(animation, kSmall);
  ASSERT_EQ(split.tracks.size(), 2u);
  EXPECT_GT(split.tracks[0].droplets[0].volume_m3, 0);
  EXPECT_LT(split.tracks[1].droplets[0].volume_m3, 0);
}

}  // namespace
}  // namespace liquidblend::spacetime::droplets_test
