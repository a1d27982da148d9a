#include "client/cli/print/stream_stats.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace liquidblend::cli
