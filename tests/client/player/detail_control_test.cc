#include "client/player/detail_control.h"

#include <gtest/gtest.h>

namespace liquidblend::player {
namespace {

DetailOptions Levels(int finest, int coarsest) {
  DetailOptions options;
  options.finest = finest;
  options.coarsest = coarsest;
  options.num_threads = 4;
  return options;
}

// A second in which so many moments were missed, and the threads were busy for so long.
struct Second {
  int num_missed = 0;
  double wait_s = 0.0;
  double decode_s = 0.0;
  int64_t num_bytes = 0;
};

class Played {
 public:
  explicit Played(const DetailOptions& options) : control(options) {
    control.Update(now_, {});
    Pass({});  // the first second
  }

  bool Pass(const Second& second) {
    counts_.num_missed += second.num_missed;
    counts_.num_shown += 60 - second.num_missed;
    FrameCost cost;
    cost.wait_s = second.wait_s;
    cost.decode_s = second.decode_s;
    cost.num_bytes = second.num_bytes;
    control.AddCost(cost);
    return control.Update(now_ += 1.0, counts_);
  }

  DetailControl control;

 private:
  double now_ = 10.0;
  ScheduleCounts counts_;
};

TEST(DetailControl, ChangesNothingWhileFramesAreInTime) {
  Played played(Levels(0, 2));
  for (int k = 0; k < 20; ++k) EXPECT_FALSE(played.Pass({1, 2.0, 1.5}));
  EXPECT_EQ(played.control.level(), 0);
}

TEST(DetailControl, OnASlowNetworkTakesDracoFirstAndThenCoarserLevels) {
  Played played(Levels(0, 2));
  EXPECT_TRUE(played.Pass({30, 3.8, 0.1, 6'000'000}));
  EXPECT_EQ(played.control.format(), FrameFormat::kDraco);
  EXPECT_EQ(played.control.level(), 0);
  EXPECT_TRUE(played.Pass({30, 1.8, 0.9, 6'000'000}));
  EXPECT_TRUE(played.Pass({30, 1.8, 0.9, 6'000'000}));
  EXPECT_EQ(played.control.format(), FrameFormat::kDraco);
  EXPECT_EQ(played.control.level(), 2);
  EXPECT_FALSE(played.Pass({30, 1.8, 0.9, 6'000'000}));
}

TEST(DetailControl, GivesDracoUpWhereItDoesNotHelp) {
  Played played(Levels(0, 2));
  EXPECT_TRUE(played.Pass({30, 3.6, 0.2, 6'000'000}));
  EXPECT_EQ(played.control.format(), FrameFormat::kDraco);
  EXPECT_TRUE(played.Pass({40, 3.0, 1.0, 3'000'000}));  // as long a frame
  EXPECT_EQ(played.control.format(), FrameFormat::kMeshopt);
  EXPECT_TRUE(played.Pass({30, 3.6, 0.2, 6'000'000}));
  EXPECT_EQ(played.control.format(), FrameFormat::kMeshopt);
  EXPECT_EQ(played.control.level(), 1);
}

TEST(DetailControl, GivesDracoUpWhereDecodingItTakesTheTime) {
  Played played(Levels(0, 0));
  EXPECT_TRUE(played.Pass({30, 3.8, 0.1, 6'000'000}));
  EXPECT_FALSE(played.Pass({30, 1.8, 0.9, 6'000'000}));
  EXPECT_TRUE(played.Pass({30, 1.0, 2.9, 6'000'000}));
  EXPECT_EQ(played.control.format(), FrameFormat::kMeshopt);
}

TEST(DetailControl, AServerThatComputesLongIsNoSlowNetwork) {
  Played played(Levels(0, 2));
  EXPECT_TRUE(played.Pass({30, 3.6, 0.2, 60'000'000}));
  EXPECT_EQ(played.control.format(), FrameFormat::kMeshopt);
  EXPECT_EQ(played.control.level(), 1);
}

TEST(DetailControl, OnASlowMachineTakesCoarserLevels) {
  Played played(Levels(0, 2));
  EXPECT_TRUE(played.Pass({30, 0.5, 3.5}));
  EXPECT_EQ(played.control.format(), FrameFormat::kMeshopt);
  EXPECT_EQ(played.control.level(), 1);
}

TEST(DetailControl, GoesBackWhenThereIsTimeToSpareAndLaterEachTimeThatWasWrong) {
  Played played(Levels(0, 1));
  const auto seconds_to_step_up = [&] {
    for (int k = 1; k < 60; ++k) {
      if (played.Pass({0, 0.1, 0.5})) return k;
    }
    return 0;
  };
  EXPECT_TRUE(played.Pass({30, 0.1, 3.5}));
  const int first = seconds_to_step_up();
  EXPECT_EQ(played.control.level(), 0);
  EXPECT_TRUE(played.Pass({30, 0.1, 3.5}));  // that was wrong
  const int second = seconds_to_step_up();
  EXPECT_GE(first, 4);
  EXPECT_GE(second, 2 * first - 1);
}

TEST(DetailControl, StaysWhereItIsIfThreadsAreBusy) {
  Played played(Levels(0, 1));
  EXPECT_TRUE(played.Pass({30, 0.1, 3.5}));
  for (int k = 0; k < 20; ++k) EXPECT_FALSE(played.Pass({0, 0.1, 2.5}));
  EXPECT_EQ(played.control.level(), 1);
}

TEST(DetailControl, AStallOfTheProgramOrAServerThatIsAwayIsNoReason) {
  DetailControl control(Levels(0, 2));
  ScheduleCounts counts;
  control.Update(0.0, counts);
  control.Update(1.0, counts);
  control.AddCost({});
  counts.num_missed = 100;
  EXPECT_FALSE(control.Update(3.0, counts)) << "two seconds without a poll";
  counts.num_missed = 150;
  EXPECT_FALSE(control.Update(4.0, counts)) << "no frame came";
  control.AddCost({});
  counts.num_missed = 200;
  EXPECT_TRUE(control.Update(5.0, counts));
}

TEST(DetailControl, KeepsToItsLimits) {
  DetailOptions options = Levels(1, 1);
  options.may_change_format = false;
  Played played(options);
  for (int k = 0; k < 5; ++k) EXPECT_FALSE(played.Pass({30, 3.8, 0.1}));
  EXPECT_EQ(played.control.level(), 1);
  EXPECT_EQ(played.control.format(), FrameFormat::kMeshopt);
}

}  // namespace
}  // namespace liquidblend::player
