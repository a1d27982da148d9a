#include "worker/ingest/frame_times.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "core/mesh/animation_limits.h"

namespace liquidblend::ingest {
namespace {

using testing::HasSubstr;

// 0, the longest gap, twice that, ... up to `last`, then one that is `step` later.
std::vector<double> TimesUpTo(double last, double step) {
  std::vector<double> times;
  for (double time = 0; time <= last; time += mesh::kLongestGap) times.push_back(time);
  times.push_back(times.back() + step);
  return times;
}

TEST(CheckFrameTimes, AllowsTheLongestTimes) {
  EXPECT_TRUE(CheckFrameTimes(TimesUpTo(mesh::kLongestTime - 1, 1), "t").ok());
  EXPECT_TRUE(CheckFrameTimes(TimesUpTo(1000, 0.0011), "t").ok());
}

TEST(CheckFrameTimes, RefusesStepsThatFloatsDoNotResolve) {
  EXPECT_THAT(std::string(CheckFrameTimes(TimesUpTo(2000, 0.001), "frame_times").message()),
              HasSubstr("frame_times[9] is 2000.001, not above 2000 by 0.0019"));
}

TEST(CheckFrameTimes, RefusesWhatLiesBeyondTheLastTime) {
  EXPECT_THAT(std::string(CheckFrameTimes(TimesUpTo(mesh::kLongestTime, 1), "t").message()),
              HasSubstr("t[401] is 100001, not a time up to 100000"));
}

}  // namespace
}  // namespace liquidblend::ingest
