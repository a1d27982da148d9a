#include "worker/registration/finer_nodes.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/worker/registration/drops_testing.h"

namespace liquidblend::registration::finer_nodes_test {
namespace {

constexpr double kHeight = 0.8;
constexpr int kNumFrames = 8;
constexpr double kHalfWidth = 2.5;  // m; of the pool
constexpr float kShift = 0.25f;     // m; of the target's drop, about three edges

mesh::SpaceTimeMesh Drops(const std::vector<synthetic::SteadyDrop>& drops) {
  return Scene(drops, kHalfWidth, kNumFrames);
}

struct Fitted {
  int num_nodes;
  Points displacement;
};

// What becomes of a registration that left everything in place.
Fitted Fit(const mesh::SpaceTimeMesh& source, const mesh::SpaceTimeMesh& target,
           const RegistrationOptions& options = {}, int num_threads = 2) {
  const parallel::Arena arena(num_threads);
  const SurfacePair pair(source, target, arena);
  SharpenState state;
  state.displacement = Points::Zero(4, source.num_vertices());
  int num_rounds = 0;
  const auto fit = [&](SharpenState& fitted) {
    const absl::Status status = RefineUnderfitRegions(
        pair, options, arena, [&] { ++num_rounds; }, fitted);
    EXPECT_TRUE(status.ok()) << status;
  };
  fit(state);
  EXPECT_GE(state.num_rounds, num_rounds) << "one that was enough stands for all";
  // As after a checkpoint: what is done is not done again.
  SharpenState resumed = state;
  fit(resumed);
  EXPECT_EQ(resumed.num_rounds, state.num_rounds);
  EXPECT_EQ(resumed.num_finer_nodes, state.num_finer_nodes);
  EXPECT_EQ(resumed.displacement, state.displacement);
  return {state.num_finer_nodes, state.displacement};
}

// Mean distance of the drop's vertices, while it is apart, from the target's, in edges.
double Miss(const mesh::SpaceTimeMesh& source, const Points& displacement) {
  double sum = 0, count = 0;
  for (int64_t v = 0; v < source.num_vertices(); ++v) {
    const Eigen::Vector4f p = source.vertices.col(v);
    if (p[3] < 1 || p[3] > 6 || p[2] < 0.1f) continue;
    const auto edge = static_cast<float>(source.edge_length_m);
    const Eigen::Vector3f moved = p.head<3>() + edge * displacement.col(v).head<3>();
    const float time = p[3] + displacement(3, v);
    const Eigen::Vector3f centre(kShift, 0, static_cast<float>(kHeight) - 0.05f * time);
    sum += std::abs((moved - centre).norm() - kDropRadius) / edge;
    ++count;
  }
  return sum / count;
}

TEST(RefineUnderfitRegions, BringsItCloseAndLeavesTheRest) {
  const auto source = Drops({DropAt(0, kHeight)}), target = Drops({DropAt(kShift, kHeight)});
  const auto [num_nodes, displacement] = Fit(source, target);
  EXPECT_GT(num_nodes, 10);
  EXPECT_GT(Miss(source, Points::Zero(4, source.num_vertices())), 0.9);
  EXPECT_LT(Miss(source, displacement), 0.3);
  for (int64_t v = 0; v < displacement.cols(); ++v) {
    if (std::abs(source.vertices(0, v)) < 2.3f) continue;  // the ends of the pool are far away
    ASSERT_EQ(displacement.col(v), Eigen::Vector4f::Zero()) << v;
  }
}

TEST(RefineUnderfitRegions, DoesNothingWhereNothingIsFar) {
  const auto source = Drops({DropAt(0, kHeight)}), target = Drops({DropAt(kShift, kHeight)});
  RegistrationOptions options;
  options.finer_from_edges = 8.0;
  const auto [num_nodes, displacement] = Fit(source, target, options);
  EXPECT_EQ(num_nodes, 0);
  EXPECT_EQ(displacement, Points::Zero(4, source.num_vertices()));
}

TEST(RefineUnderfitRegions, WhatThereIsNoRoomForAtOnceFollows) {
  const auto source = Drops({DropAt(-1.5, kHeight), DropAt(1.5, kHeight)});
  const auto target = Drops({DropAt(-1.5 + kShift, kHeight), DropAt(1.5 + 0.6 * kShift, kHeight)});
  RegistrationOptions options;
  options.coarse_vertices = 2000;  // room for one of them
  options.finer_from_edges = 0.8;
  const Points displacement = Fit(source, target, options).displacement;
  double left = 0, right = 0;
  for (int64_t v = 0; v < displacement.cols(); ++v) {
    (source.vertices(0, v) < 0 ? left : right) += displacement.col(v).norm();
  }
  EXPECT_GT(left, 1000);
  EXPECT_GT(right, 1000);
}

TEST(RefineUnderfitRegions, GivesTheSameBytesForAnyNumberOfThreads) {
  const auto source = Drops({DropAt(0, kHeight)}), target = Drops({DropAt(kShift, kHeight)});
  EXPECT_EQ(Fit(source, target, {}, 1).displacement, Fit(source, target, {}, 8).displacement);
}

}  // namespace
}  // namespace liquidblend::registration::finer_nodes_test
