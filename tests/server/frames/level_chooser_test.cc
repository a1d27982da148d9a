#include "server/frames/level_chooser.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace liquidblend::server {
namespace {

constexpr absl::Duration kPeriod = absl::Milliseconds(40);

// A connection that carries `bytes_per_period` of frames that have 1 byte at the finest level and
// half of that at each coarser one.
struct Connection {
  LevelChooser chooser;
  absl::Duration now;

  void Show(int num_frames, double bytes_per_period, int max_coarser = 2) {
    for (int k = 0; k < num_frames; ++k) {
      const double bytes = 1.0 / (1 << chooser.num_coarser());
      const absl::Duration took = kPeriod * (bytes / bytes_per_period);
      now += std::max(kPeriod, took);
      chooser.OnWritten(took, kPeriod, max_coarser, now);
    }
  }
};

TEST(LevelChooser, StaysFineOnAFastConnection) {
  Connection connection;
  connection.Show(1000, 3.0);
  EXPECT_EQ(connection.chooser.num_coarser(), 0);
}

TEST(LevelChooser, GoesAsCoarseAsTheConnectionNeeds) {
  Connection connection;
  connection.Show(30, 0.7);
  EXPECT_EQ(connection.chooser.num_coarser(), 1);
  connection.Show(30, 0.3);
  EXPECT_EQ(connection.chooser.num_coarser(), 2);
}

TEST(LevelChooser, NeverGoesBeyondWhatTheFamilyHas) {
  Connection connection;
  connection.Show(100, 0.01);
  EXPECT_EQ(connection.chooser.num_coarser(), 2);
  connection.Show(1, 0.01, 1);
  EXPECT_EQ(connection.chooser.num_coarser(), 1);
}

TEST(LevelChooser, OneSlowFrameDecidesNothing) {
  Connection connection;
  connection.Show(100, 10.0);
  connection.Show(1, 0.001);
  connection.Show(1, 10.0);
  EXPECT_EQ(connection.chooser.num_coarser(), 0);
}

TEST(LevelChooser, ComesBackWhenTheConnectionDoes) {
  Connection connection;
  connection.Show(50, 0.2);
  EXPECT_EQ(connection.chooser.num_coarser(), 2);
  connection.Show(200, 10.0);
  EXPECT_EQ(connection.chooser.num_coarser(), 0);
}

// Level 1 is written in no time, level 0 takes too long: trials must become rare.
TEST(LevelChooser, TrialsThatFailBecomeRare) {
  LevelChooser chooser;
  absl::Duration now;
  int num_trials = 0;
  for (int k = 0; k < 24'000; ++k) {  // 16 minutes
    const bool was_coarse = chooser.num_coarser() > 0;
    now += kPeriod;
    chooser.OnWritten(was_coarse ? absl::ZeroDuration() : 1.5 * kPeriod, kPeriod, 2, now);
    if (was_coarse && chooser.num_coarser() == 0) ++num_trials;
  }
  EXPECT_GE(num_trials, 15);
  EXPECT_LE(num_trials, 22);  // after 2, 4, ... 64 s, then each minute
}

}  // namespace
}  // namespace liquidblend::server
