#include "core/finish/smooth_in_time.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <string>

#include "tests/core/finish/finish_testing.h"
#include "tests/core/finish/height_probe.h"
#include "tests/synthetic/families.h"

namespace liquidblend::finish::smooth_in_time_test {
namespace {

constexpr float kMaxOffsetM = 0.03F;

TemporalOptions Strength(double strength) { return {strength, kMaxOffsetM}; }

synthetic::ComplexOptions Moving() {
  synthetic::ComplexOptions options;
  options.num_frames = 12;
  options.velocity_m_per_frame = {0.05F, 0.02F, 0.04F};
  options.growth_per_frame = 0.02F;
  return options;
}

// At weight 1 every vertex trembles by up to 0.02 m.
Slicer TremblingSphere() {
  return Slicer(synthetic::MakeFamily(synthetic::HexahedralSphere(10, Moving()),
                                      {{synthetic::Noise(5, 0.02F, 0.0F), {}}}));
}

double FlickerOf(Slicer& slicer, const TemporalOptions& options) {
  std::vector<std::vector<float>> heights;
  const Places places{{-0.2F, -0.2F}, {0.5F, 0.4F}, 25};
  for (int frame = 1; frame <= 10; ++frame) {
    heights.push_back(HeightsAbove(slicer.Cut({1.0}, frame, options), places));
  }
  return Flicker(heights, 0.2F);
}

TEST(SmoothInTime, TakesTremblingOut) {
  Slicer slicer = TremblingSphere();
  const double before = FlickerOf(slicer, {});
  const double half = FlickerOf(slicer, Strength(0.5));
  const double whole = FlickerOf(slicer, Strength(1.0));
  EXPECT_LT(half, 0.7 * before);
  EXPECT_LT(whole, 0.4 * before);  // 1/4, 1/2, 1/4 leaves a quarter of white noise
}

TEST(SmoothInTime, LeavesSteadyMotionAsItIs) {
  Slicer slicer(synthetic::MakeFamily(synthetic::HexahedralSphere(8, Moving()), {}));
  for (const double frame : {0.0, 3.0, 5.4, 11.0}) {
    const mesh::TriangleMesh plain = slicer.Cut({}, frame);
    const mesh::TriangleMesh smooth = slicer.Cut({}, frame, Strength(1.0));
    ASSERT_EQ(smooth.num_vertices(), plain.num_vertices());
    EXPECT_LT((smooth.vertices - plain.vertices).cwiseAbs().maxCoeff(), 1e-5F) << frame;
  }
}

TEST(SmoothInTime, NoVertexGoesFurtherThanTheLimit) {
  const mesh::RegisteredFamily family = synthetic::MakeFamily(
      synthetic::HexahedralSphere(6, Moving()), {{synthetic::Noise(6, 0.5F, 0.2F), {}}});
  const TimeLinks links(family);
  std::vector<int32_t> vertices(600);
  std::iota(vertices.begin(), vertices.end(), 100);
  const blend::Blender blender(family, std::vector{1.0});
  std::vector<mesh::Float4> plain(600), smooth(600);
  blender.Place(vertices, plain.data());
  TemporalWorkspace workspace;
  TimeSmoother(links, blender, Strength(1.0), workspace).Place(vertices, smooth.data());
  float longest = 0.0F;
  for (size_t v = 0; v < 600; ++v) {
    EXPECT_EQ(smooth[v][3], plain[v][3]);
    longest = std::max(longest, std::hypot(smooth[v][0] - plain[v][0], smooth[v][1] - plain[v][1],
                                           smooth[v][2] - plain[v][2]));
  }
  EXPECT_NEAR(longest, kMaxOffsetM, 1e-6F);
}

TEST(SmoothInTime, SlicesStayClosedAtAnyWeightsAndTimes) {
  Slicer slicer(
      synthetic::MakeFamily(synthetic::MixedSphere(6, Moving()),
                            {{synthetic::Noise(1, 0.3F, 2.0F), synthetic::Noise(2, 0.2F, 1.0F)}}));
  for (const double weight : {-1.0, 0.0, 0.5, 1.0, 2.0}) {
    for (double frame = 0.0; frame <= 11.0; frame += 0.23) {
      const mesh::TriangleMesh surface = slicer.Cut({weight}, frame, {1.0, 1.0});
      EXPECT_TRUE(mesh::CheckClosed(surface).closed()) << weight << " at " << frame;
      EXPECT_GT(surface.num_triangles(), 0);
    }
  }
}

TEST(SmoothInTime, OptionsOutOfRangeAreRefusedByName) {
  const auto message = [](const TemporalOptions& options) {
    return std::string(options.Validate().message());
  };
  EXPECT_TRUE(TemporalOptions().Validate().ok());
  EXPECT_THAT(message({1.1, 0.0}), testing::HasSubstr("strength is 1.1"));
  EXPECT_THAT(message({std::nan(""), 0.0}), testing::HasSubstr("strength is nan"));
  EXPECT_THAT(message({0.5, -1.0}), testing::HasSubstr("max_offset_m is -1"));
}

}  // namespace
}  // namespace liquidblend::finish::smooth_in_time_test
