#include "client/cli/print/stream_stats.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace liquidblend::cli {
namespace {

TEST(Percentiles, AreNearestRanks) {
  std::vector<double> values;
  for (int i = 100; i >= 1; --i) values.push_back(i);
  const Percentiles p = ComputePercentiles(values);
  EXPECT_EQ(p.p50, 50);
  EXPECT_EQ(p.p95, 95);
  EXPECT_EQ(p.p99, 99);
  EXPECT_EQ(p.max, 100);
  EXPECT_EQ(ComputePercentiles({7}).p50, 7);
  EXPECT_EQ(ComputePercentiles({}).max, 0);
}

// Ten frames a second; the third comes 50 ms late, then one is dropped.
TEST(StreamStats, MeasuresAgainstAnEvenPace) {
  StreamStats stats(10.0);
  const absl::Time start = absl::UnixEpoch();
  const int at_ms[] = {0, 100, 250, 400};
  const int dropped[] = {0, 0, 0, 1};
  for (int i = 0; i < 4; ++i) {
    StreamedFrame streamed;
    streamed.frame.data = "1234";
    streamed.frame_index = i;
    streamed.num_dropped = dropped[i];
    streamed.level_of_detail = i < 3 ? 0 : 2;
    stats.AddFrame(streamed, start + absl::Milliseconds(at_ms[i]));
  }
  EXPECT_EQ(stats.num_frames(), 4);
  EXPECT_EQ(stats.num_bytes(), 16);
  EXPECT_EQ(stats.num_dropped(), 1);
  EXPECT_EQ(stats.frames_by_level(), (std::vector<int64_t>{3, 0, 1}));
  EXPECT_NEAR(stats.FramesPerSecond(), 3.0 / 0.4, 1e-9);
  EXPECT_NEAR(stats.IntervalsMs().max, 150.0, 1e-6);
  EXPECT_NEAR(stats.LatenessMs().max, 50.0, 1e-6);
  EXPECT_NEAR(stats.LatenessMs().p50, 0.0, 1e-6);
}

// Numbers of a server that lies.
TEST(StreamStats, CountsAnyNumbersInBoundedMemory) {
  StreamStats stats(5e-324);
  constexpr int64_t kMost = std::numeric_limits<int64_t>::max();
  for (const int level :
       {std::numeric_limits<int>::max(), 16, 15, 1, -1, std::numeric_limits<int>::min()}) {
    StreamedFrame streamed;
    streamed.frame_index = streamed.num_dropped = level == 1 ? 0 : kMost;
    streamed.level_of_detail = level;
    stats.AddFrame(streamed, absl::UnixEpoch());
  }
  ASSERT_EQ(stats.frames_by_level().size(), 16U);
  EXPECT_EQ(stats.frames_by_level()[0], 2);
  EXPECT_EQ(stats.frames_by_level()[1], 1);
  EXPECT_EQ(stats.frames_by_level()[15], 3);
  EXPECT_EQ(stats.LatenessMs().max, 0.0);
}

TEST(Percentiles, LeaveOutWhatHasNoOrder) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(ComputePercentiles({nan, 3, -INFINITY, 2, INFINITY, nan}).max, 3);
  EXPECT_EQ(ComputePercentiles({nan}).max, 0);
}

}  // namespace
}  // namespace liquidblend::cli
