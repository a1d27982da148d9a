#include "core/mesh/animation_limits.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

namespace liquidblend::mesh {
namespace {

using testing::HasSubstr;

// A triangle of this size a frame; its first corner is at the origin.
Animation At(const std::vector<double>& times, float size_m = 1.0F) {
  Animation animation;
  animation.name = "drop";
  animation.times = times;
  animation.frames.resize(times.size());
  for (TriangleMesh& frame : animation.frames) {
    frame.vertices = size_m * Eigen::Matrix3Xf::Identity(3, 3);
    frame.triangles = Eigen::Vector3i(0, 1, 2);
  }
  return animation;
}

std::string ErrorOf(const absl::Status& status) {
  EXPECT_EQ(status.ok() ? absl::StatusCode::kInvalidArgument : status.code(),
            absl::StatusCode::kInvalidArgument);
  return std::string(status.message());
}

TEST(CheckTimes, AllowsGapsUpToTheLimit) {
  EXPECT_TRUE(CheckTimes(At({0, 1, 2})).ok());
  EXPECT_TRUE(CheckTimes(At({})).ok());
  EXPECT_TRUE(CheckTimes(At({0, 0.001, 250, 500})).ok());
}

TEST(CheckTimes, NamesTheFrameTheTimeAndTheLimit) {
  EXPECT_THAT(ErrorOf(CheckTimes(At({0, 1, 1e9}))),
              HasSubstr("animation 'drop', frame 2: its time is 1e+09 frames, not in [0, 100000]"));
  EXPECT_THAT(ErrorOf(CheckTimes(At({0, 1, 252}))), HasSubstr("frame 2: it comes 251 frames"));
  EXPECT_THAT(ErrorOf(CheckTimes(At({0, 1, 1}))), HasSubstr("frame 2: it comes 0 frames"));
  EXPECT_THAT(ErrorOf(CheckTimes(At({0, std::numeric_limits<double>::quiet_NaN()}))),
              HasSubstr("frame 1: its time is nan"));
}

TEST(CheckTimes, StepsAreResolvedByFloats) {
  for (const double time : {1.0, 1000.0, 4096.0, kLongestTime}) {
    const auto later = static_cast<float>(time),
               earlier = static_cast<float>(time - SmallestStep(time) / 4);
    EXPECT_GT(later, earlier) << time;
  }
}

TEST(CheckExtent, AllowsWhatFloatsResolve) {
  EXPECT_TRUE(CheckExtent(At({0, 1})).ok());
  Animation far = At({0, 1});
  far.frames[1].vertices.array() += 900'000.0F;
  EXPECT_TRUE(CheckExtent(far).ok());
}

TEST(CheckExtent, NamesTheFrameTheCoordinateAndTheLimit) {
  Animation far = At({0, 1, 2}, 0.01F);
  far.frames[1].vertices.array() += 1e5F;
  EXPECT_THAT(ErrorOf(CheckExtent(far)),
              HasSubstr("frame 1: a coordinate of 100000 m is beyond 1e+06 mean edge lengths"));
}

}  // namespace
}  // namespace liquidblend::mesh
