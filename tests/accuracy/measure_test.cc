#include "tests/accuracy/measure.h"

#include <gtest/gtest.h>

#include "tests/synthetic/shapes.h"

namespace liquidblend::accuracy {
namespace {

constexpr double kEdge = 0.1;
constexpr Frames kFrames = {.num = 4, .num_early = 2, .step = 1};

mesh::TriangleMesh Spheres(double radius_m) {
  const mesh::TriangleMesh parts[] = {synthetic::Icosphere({0, 0, 0}, 1.0, 3),
                                      synthetic::Icosphere({3, 0, 0}, radius_m, 3)};
  return synthetic::Join(parts);
}

mesh::Animation Still(const mesh::TriangleMesh& surface) {
  mesh::Animation animation;
  animation.frames.assign(kFrames.num, surface);
  return animation;
}

TEST(Measure, DistanceIsInEdgesAndByFrames) {
  const parallel::Arena arena(2);
  const mesh::Animation truth = Still(synthetic::Icosphere({0, 0, 0}, 1.0, 3));
  const auto grows_late = [](double frame) {
    return synthetic::Icosphere({0, 0, 0}, frame < 2 ? 1.0 : 1.1, 3);
  };
  const Means means = MeanDistance(grows_late, truth, kFrames, kEdge, arena);
  EXPECT_NEAR(means.early, 0.0, 1e-5);
  EXPECT_NEAR(means.all, 0.5, 0.01);  // 0.1 m in half of the frames
}

TEST(Measure, InvertedShareSeesFramesThatAreInsideOut) {
  const parallel::Arena arena(2);
  const auto turns = [](double frame) {
    const mesh::TriangleMesh sphere = synthetic::Icosphere({0, 0, 0}, 1.0, 3);
    return frame < 2 ? sphere : synthetic::Flipped(sphere);
  };
  EXPECT_NEAR(InvertedShare(turns, kFrames, kEdge, arena), 0.5, 1e-9);
}

TEST(Measure, ComponentsAreComparedByVolume) {
  const parallel::Arena arena(2);
  const mesh::Animation a = Still(Spheres(0.5)), b = Still(Spheres(0.5));
  const auto smaller = [](double) { return Spheres(0.45); };
  const ComponentErrors errors = CompareComponents(smaller, {&a, &b}, kFrames, arena);
  EXPECT_EQ(errors.num_frames, 4);
  EXPECT_EQ(errors.num_alike, 4);
  EXPECT_NEAR(errors.largest_error, 1 - 0.9 * 0.9 * 0.9, 1e-3);
  EXPECT_EQ(errors.mean_components, 2);
  const auto merged = [](double) { return synthetic::Icosphere({0, 0, 0}, 1.0, 3); };
  EXPECT_EQ(CompareComponents(merged, {&a, &b}, kFrames, arena).num_alike, 0);
}

TEST(Measure, PartsThatMergeDoNotCountWhenTheyAreApartAgain) {
  const parallel::Arena arena(2);
  mesh::Animation truth = Still(Spheres(0.5));
  truth.frames[2] = synthetic::Icosphere({0, 0, 0}, 1.0, 3);
  const auto smaller_at_last = [&](double frame) {
    return frame == 3 ? Spheres(0.3) : truth.frames[static_cast<size_t>(frame)];
  };
  const ComponentErrors errors = CompareComponents(smaller_at_last, {&truth}, kFrames, arena);
  EXPECT_EQ(errors.num_alike, 3);
  EXPECT_EQ(errors.largest_error, 0);
}

TEST(Measure, VolumeErrorNamesTheWorstFrame) {
  const parallel::Arena arena(2);
  const mesh::Animation a = Still(Spheres(0.5));
  const auto worst_at_two = [](double frame) { return Spheres(frame == 2 ? 0.4 : 0.5); };
  const VolumeError error = CompareVolumes(worst_at_two, {&a}, kFrames, arena);
  const double expected = 1 - (1 + 0.064) / (1 + 0.125);
  EXPECT_EQ(error.largest_at, 2);
  EXPECT_NEAR(error.largest, expected, 1e-3);
  EXPECT_NEAR(error.mean, expected / 4, 1e-3);
}

}  // namespace
}  // namespace liquidblend::accuracy
