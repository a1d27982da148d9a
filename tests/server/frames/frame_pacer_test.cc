#include "server/frames/frame_pacer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace liquidblend::server {
namespace {

constexpr double kTolerance = 1e-9;  // s; rounding of a few additions

absl::Duration Ms(double milliseconds) { return absl::Milliseconds(milliseconds); }

// 11 frames at 10 frames per second.
Pace OneSecond() {
  Pace pace;
  pace.duration_s = 1.0;
  pace.frames_per_second = 10.0;
  return pace;
}

// Times of all ticks if each is taken when it is due, at most `limit` of them.
std::vector<double> TakeAll(FramePacer& pacer, absl::Duration now, int limit = 1000) {
  std::vector<double> times;
  while (static_cast<int>(times.size()) < limit) {
    const auto tick = pacer.Next(now);
    if (!tick.has_value()) break;
    now = std::max(now, tick->due);
    times.push_back(tick->time_s);
    pacer.Advance();
  }
  return times;
}

TEST(FramePacer, ShowsEachFrameOnceAtItsTime) {
  FramePacer pacer;
  pacer.Change(OneSecond(), std::nullopt, Ms(5000));
  for (int k = 0; k <= 10; ++k) {
    const auto tick = pacer.Next(Ms(5000 + 100 * k));
    ASSERT_TRUE(tick.has_value()) << k;
    EXPECT_NEAR(absl::ToDoubleSeconds(tick->due), 5.0 + 0.1 * k, kTolerance);
    EXPECT_NEAR(tick->time_s, 0.1 * k, kTolerance);
    pacer.Advance();
  }
  EXPECT_FALSE(pacer.Next(Ms(6100)).has_value());
  EXPECT_EQ(pacer.num_skipped(), 0);
}

TEST(FramePacer, ATickStaysTheSameUntilItIsTaken) {
  FramePacer pacer;
  pacer.Change(OneSecond(), 0.25, Ms(0));
  EXPECT_EQ(pacer.Next(Ms(0))->time_s, 0.25);
  EXPECT_EQ(pacer.Next(Ms(50))->time_s, 0.25);
}

// What follows a frame is where another pacer goes on: at the end, too, and round the loop.
TEST(FramePacer, AnotherOneGoesOnFromTheNextTime) {
  for (const bool is_loop : {false, true}) {
    Pace pace = OneSecond();
    pace.loop = is_loop;
    FramePacer whole;
    whole.Change(pace, std::nullopt, Ms(0));
    const std::vector<double> expected = TakeAll(whole, Ms(0), 25);
    std::vector<double> times;
    std::optional<double> next = 0.0;
    while (next.has_value() && times.size() < expected.size()) {
      FramePacer part;
      part.Change(pace, next, Ms(0));
      times.push_back(part.Next(Ms(0))->time_s);
      part.Advance();
      next = part.NextTime();
    }
    ASSERT_EQ(times.size(), expected.size());
    for (size_t k = 0; k < times.size(); ++k) EXPECT_NEAR(times[k], expected[k], kTolerance) << k;
    EXPECT_EQ(next.has_value(), is_loop);
  }
}

TEST(FramePacer, SkipsAndCountsWhatIsLate) {
  FramePacer pacer;
  pacer.Change(OneSecond(), std::nullopt, Ms(0));
  EXPECT_NEAR(pacer.Next(Ms(0))->time_s, 0.0, kTolerance);
  pacer.Advance();
  const auto tick = pacer.Next(Ms(450));  // 100, 200 and 300 are late; 400 is the newest
  EXPECT_NEAR(tick->time_s, 0.4, kTolerance);
  EXPECT_EQ(pacer.num_skipped(), 3);
}

TEST(FramePacer, LateByLessThanAPeriodIsNotSkipped) {
  FramePacer pacer;
  pacer.Change(OneSecond(), std::nullopt, Ms(0));
  pacer.Advance();
  EXPECT_NEAR(pacer.Next(Ms(190))->time_s, 0.1, kTolerance);
  EXPECT_EQ(pacer.num_skipped(), 0);
}

TEST(FramePacer, TheLastFrameIsShownHoweverLate) {
  FramePacer pacer;
  pacer.Change(OneSecond(), std::nullopt, Ms(0));
  pacer.Advance();
  EXPECT_NEAR(pacer.Next(Ms(99000))->time_s, 1.0, kTolerance);
  EXPECT_EQ(pacer.num_skipped(), 9);
  pacer.Advance();
  EXPECT_FALSE(pacer.Next(Ms(99000)).has_value());
}

TEST(FramePacer, LosslessSkipsNothingAndNeverWaits) {
  FramePacer pacer;
  Pace pace = OneSecond();
  pace.lossless = true;
  pacer.Change(pace, std::nullopt, Ms(0));
  for (int k = 0; k <= 10; ++k) {
    const auto tick = pacer.Next(Ms(700 * k));
    ASSERT_TRUE(tick.has_value());
    EXPECT_LE(tick->due, Ms(700 * k));
    EXPECT_NEAR(tick->time_s, 0.1 * k, kTolerance);
    pacer.Advance();
  }
  EXPECT_FALSE(pacer.Next(Ms(9000)).has_value());
  EXPECT_EQ(pacer.num_skipped(), 0);
}

TEST(FramePacer, ALoopShowsTheLastFrameThenTheFirst) {
  FramePacer pacer;
  Pace pace = OneSecond();
  pace.loop = true;
  pacer.Change(pace, std::nullopt, Ms(0));
  const std::vector<double> times = TakeAll(pacer, Ms(0), 1000);
  ASSERT_EQ(times.size(), 1000U);
  for (int k = 0; k < 1000; ++k) EXPECT_NEAR(times[k], 0.1 * (k % 11), kTolerance) << k;
}

TEST(FramePacer, ANegativeRateRunsBackToTheFirstFrame) {
  FramePacer pacer;
  Pace pace = OneSecond();
  pace.rate = -2.0;
  pacer.Change(pace, 1.0, Ms(0));
  const std::vector<double> times = TakeAll(pacer, Ms(0));
  ASSERT_EQ(times.size(), 6U);
  for (int k = 0; k < 6; ++k) EXPECT_NEAR(times[k], 1.0 - 0.2 * k, kTolerance);
}

TEST(FramePacer, ALoopAlsoRunsBackwards) {
  FramePacer pacer;
  Pace pace = OneSecond();
  pace.rate = -1.0;
  pace.loop = true;
  pacer.Change(pace, 0.1, Ms(0));
  const std::vector<double> times = TakeAll(pacer, Ms(0), 4);
  const std::vector<double> expected = {0.1, 0.0, 1.0, 0.9};
  for (int k = 0; k < 4; ++k) EXPECT_NEAR(times[k], expected[k], kTolerance) << k;
}

TEST(FramePacer, RateZeroHoldsTheTimeAndKeepsThePace) {
  FramePacer pacer;
  Pace pace = OneSecond();
  pace.rate = 0.0;
  pacer.Change(pace, 0.3, Ms(0));
  for (int k = 0; k < 50; ++k) {
    const auto tick = pacer.Next(Ms(100 * k));
    ASSERT_TRUE(tick.has_value());
    EXPECT_EQ(tick->time_s, 0.3);
    EXPECT_NEAR(absl::ToDoubleSeconds(tick->due), 0.1 * k, kTolerance);
    pacer.Advance();
  }
}

TEST(FramePacer, AChangeOfRateGoesOnFromTheNextFrame) {
  FramePacer pacer;
  Pace pace = OneSecond();
  pacer.Change(pace, std::nullopt, Ms(0));
  pacer.Advance();
  pacer.Advance();  // the next one shows 0.2 s and is due at 200 ms
  pace.rate = 0.5;
  pacer.Change(pace, std::nullopt, Ms(130));
  const auto tick = pacer.Next(Ms(130));
  EXPECT_NEAR(tick->time_s, 0.2, kTolerance);
  EXPECT_NEAR(absl::ToDoubleSeconds(tick->due), 0.2, kTolerance);
  pacer.Advance();
  EXPECT_NEAR(pacer.Next(Ms(200))->time_s, 0.25, kTolerance);
}

TEST(FramePacer, AFasterPaceDoesNotWaitForTheSlowOne) {
  FramePacer pacer;
  Pace pace = OneSecond();
  pace.frames_per_second = 0.1;
  pacer.Change(pace, std::nullopt, Ms(0));
  pacer.Advance();  // the next one is due after 10 s
  pace.frames_per_second = 100.0;
  pacer.Change(pace, 0.0, Ms(50));
  EXPECT_LE(pacer.Next(Ms(50))->due, Ms(60));
}

TEST(FramePacer, AfterALosslessStretchThePaceIsTheClocksAgain) {
  FramePacer pacer;
  Pace pace = OneSecond();
  pace.lossless = true;
  pacer.Change(pace, std::nullopt, Ms(0));
  for (int k = 0; k < 5; ++k) pacer.Advance();
  pace.lossless = false;
  pacer.Change(pace, std::nullopt, Ms(10));
  EXPECT_EQ(pacer.Next(Ms(10))->due, Ms(10));
  EXPECT_NEAR(pacer.Next(Ms(10))->time_s, 0.5, kTolerance);
}

// Whatever the numbers, the first and the last frame are shown, and no step is left out.
TEST(FramePacer, RoundingLosesNoFrame) {
  for (const double fps : {23.976, 24.0, 25.0, 29.97, 30.0, 60.0}) {
    for (int num_frames = 2; num_frames < 300; num_frames += 7) {
      Pace pace;
      pace.frames_per_second = fps;
      pace.duration_s = (num_frames - 1) / fps;
      FramePacer pacer;
      pacer.Change(pace, std::nullopt, Ms(0));
      const std::vector<double> times = TakeAll(pacer, Ms(0));
      ASSERT_EQ(times.size(), static_cast<size_t>(num_frames)) << fps;
      EXPECT_EQ(times.front(), 0.0);
      EXPECT_NEAR(times.back(), pace.duration_s, kTolerance);
    }
  }
}

// Old stores may hold families of any frame rate, and clients send any numbers.
TEST(FramePacer, AnyNumbersGiveTicksInsideOfTheAnimation) {
  constexpr double kInf = std::numeric_limits<double>::infinity();
  const std::vector<double> extremes = {0.0,
                                        -0.0,
                                        1e-320,
                                        1e-15,
                                        1e-10,
                                        1.0,
                                        1e10,
                                        1e300,
                                        std::numeric_limits<double>::max(),
                                        -1.0,
                                        -1e300,
                                        kInf,
                                        -kInf,
                                        std::numeric_limits<double>::quiet_NaN()};
  for (const double fps : extremes) {
    for (const double rate : extremes) {
      for (const double duration_s : extremes) {
        for (const bool is_lossless : {false, true}) {
          const Pace pace = {duration_s, fps, rate, /*loop=*/true, is_lossless};
          const double end_s = std::isnan(duration_s) ? 0.0 : std::max(duration_s, 0.0);
          FramePacer pacer;
          pacer.Change(pace, std::nullopt, Ms(0));
          int64_t num_skipped = 0;
          for (const double now_s : {0.0, 0.1, 1e3, 1e9, 9e9}) {
            const auto tick = pacer.Next(absl::Seconds(now_s));
            ASSERT_TRUE(tick.has_value());
            ASSERT_GE(tick->time_s, 0.0) << fps << " " << rate << " " << duration_s;
            ASSERT_LE(tick->time_s, end_s) << fps << " " << rate << " " << duration_s;
            ASSERT_LT(tick->due, absl::InfiniteDuration());
            ASSERT_GE(pacer.num_skipped(), num_skipped) << fps << " " << rate << " " << duration_s;
            num_skipped = pacer.num_skipped();
            pacer.Advance();
          }
          pacer.Change(pace, 0.5, absl::Seconds(9e9));
        }
      }
    }
  }
}

}  // namespace
}  // namespace liquidblend::server
