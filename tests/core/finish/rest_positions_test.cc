#include "core/finish/rest_positions.h"

#include <gtest/gtest.h>

#include <optional>

#include "tests/core/finish/finish_testing.h"
#include "tests/synthetic/families.h"

namespace liquidblend::finish::rest_positions_test {
namespace {

using Eigen::Vector3f;
using Eigen::Vector4f;

constexpr float kNear = 1e-4F;  // below a step of the default grid of 14 bits

// Moves everything, and later by so many frames.
const Vector3f kMove = {0.3F, -0.2F, 0.5F};
constexpr float kDelay = 1.5F;
const synthetic::TargetFields kTarget = {
    [](int64_t, const Vector4f&) { return Vector4f(kMove[0], kMove[1], kMove[2], kDelay); }, {}};

synthetic::ComplexOptions Moving() {
  synthetic::ComplexOptions options;
  options.num_frames = 12;
  options.velocity_m_per_frame = {0.05F, 0.02F, 0.04F};
  return options;
}

TEST(AddRestPositions, AreTheVerticesThemselvesAtWeightZero) {
  Slicer slicer(synthetic::MakeFamily(synthetic::MixedSphere(8, Moving()), {kTarget}));
  for (const double frame : {0.0, 3.4, 11.0}) {
    mesh::TriangleMesh surface = slicer.Cut({0.0}, frame);
    slicer.AddRestPositionsTo(surface);
    ASSERT_EQ(surface.rest.cols(), surface.num_vertices());
    const auto time_s = static_cast<float>(frame / slicer.family().frames_per_second);
    for (Eigen::Index v = 0; v < surface.num_vertices(); ++v) {
      EXPECT_LT((surface.rest.col(v).head<3>() - surface.vertices.col(v)).norm(), kNear);
      EXPECT_NEAR(surface.rest(3, v), time_s, kNear);
    }
  }
}

TEST(AddRestPositions, ArePlacesOfTheSourceAtAnyWeight) {
  for (const std::optional<double> rest_time_s : {std::optional<double>(), std::optional(0.0)}) {
    mesh::RegisteredFamily family =
        synthetic::MakeFamily(synthetic::HexahedralSphere(12, Moving()), {kTarget});
    family.rest_time_s = rest_time_s;
    Slicer slicer(std::move(family));
    const mesh::TimeAxis axis = slicer.family().time_axis();
    const auto fps = static_cast<float>(slicer.family().frames_per_second);
    for (const double weight : {0.25, 1.0, -0.5}) {
      mesh::TriangleMesh surface = slicer.Cut({weight}, 5.0);
      slicer.AddRestPositionsTo(surface);
      for (Eigen::Index v = 0; v < surface.num_vertices(); ++v) {
        const Vector3f rest = surface.rest.col(v).head<3>();
        const auto moved = static_cast<float>(weight) * kMove;
        EXPECT_LT((rest + moved - surface.vertices.col(v)).norm(), kNear) << weight;
        // On the source's surface at that time: a sphere of radius 1, of 12 x 12 quads a side.
        const float frame = surface.rest(3, v) * fps;
        const auto ticks = static_cast<float>(axis.Ticks(frame));
        EXPECT_NEAR((rest - ticks * Moving().velocity_m_per_frame).norm(), 1.0, 0.02) << frame;
        if (!rest_time_s) {
          EXPECT_NEAR(frame, 5.0 - weight * kDelay, 1e-3);
        }
      }
    }
  }
}

Eigen::Index NearestVertex(const mesh::TriangleMesh& surface, const Vector3f& place) {
  Eigen::Index nearest = 0;
  (surface.vertices.colwise() - place).colwise().squaredNorm().minCoeff(&nearest);
  return nearest;
}

// What lies at a vertex has moved on in the next slice, and its rest position has moved as the
// liquid moves in the source.
TEST(AddRestPositions, StayOnTheLiquidFromFrameToFrame) {
  Slicer slicer(synthetic::MakeFamily(synthetic::HexahedralSphere(12, Moving()), {kTarget}));
  constexpr float kStep = 0.75F;  // frames
  const Vector3f motion = kStep * Moving().velocity_m_per_frame;
  const auto step_s = static_cast<float>(kStep / slicer.family().frames_per_second);
  for (const double weight : {0.0, 0.5, 1.0}) {
    mesh::TriangleMesh before = slicer.Cut({weight}, 5.0);
    slicer.AddRestPositionsTo(before);
    mesh::TriangleMesh after = slicer.Cut({weight}, 5.0 + kStep);
    slicer.AddRestPositionsTo(after);
    for (Eigen::Index v = 0; v < before.num_vertices(); ++v) {
      const Vector3f place = before.vertices.col(v) + motion;
      const Eigen::Index u = NearestVertex(after, place);
      ASSERT_LT((after.vertices.col(u) - place).norm(), kNear) << weight;
      const Vector4f change = after.rest.col(u) - before.rest.col(v);
      EXPECT_LT((change.head<3>() - motion).norm(), kNear) << weight;
      EXPECT_NEAR(change[3], step_s, kNear) << weight;
    }
  }
}

}  // namespace
}  // namespace liquidblend::finish::rest_positions_test
