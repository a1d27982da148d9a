#include "client/player/schedule.h"

#include <gtest/gtest.h>

#include <deque>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace liquidblend::player {
namespace {

constexpr double kDuration_s = 4.0;
constexpr double kFramesPerSecond = 60.0;
constexpr double kMoment_s = 1.0 / kFramesPerSecond;

// A program that polls sixty times a second, and threads that take so long for each frame. Frames
// tell by their facts what they show.
class Simulation {
 public:
  explicit Simulation(double look_ahead_s = 0.5, int num_threads = 4)
      : schedule(kDuration_s, {kFramesPerSecond, look_ahead_s}),
        pool_(std::make_shared<FramePool>(Allocator())),
        num_threads_(num_threads) {
    Weigh(0.0, 0.0);
  }

  void Weigh(double weight, double over_s) {
    BlendSpec blend;
    blend.weights = {weight};
    schedule.SetBlend(blend, over_s, schedule.now());
  }

  // One poll, `kMoment_s` after the one before. Returns the frame that is shown.
  FramePtr Poll() {
    now += kMoment_s;
    for (auto job = on_their_way_.begin(); job != on_their_way_.end();) {
      if (is_stopped || job->first > now) {
        ++job;
        continue;
      }
      Arrive(job->second);
      job = on_their_way_.erase(job);
    }
    const FramePtr shown = schedule.Advance(now);
    while (static_cast<int>(on_their_way_.size()) < num_threads_) {
      const auto job = schedule.Next(latency_s);
      if (!job) break;
      ++num_jobs;
      on_their_way_.emplace_back(now + latency_s, *job);
    }
    return shown;
  }

  double now = 100.0;
  double latency_s = 0.01;
  bool is_stopped = false;  // the server does not answer
  int num_jobs = 0;
  Schedule schedule;

 private:
  void Arrive(const Schedule::Job& job) {
    const std::shared_ptr<FrameMesh> frame = pool_->Take();
    frame->facts.time_s = job.spec.time_s;
    frame->facts.weights = job.spec.blend.weights;
    frame->facts.level_of_detail = job.spec.surface.level_of_detail;
    schedule.Deliver(job, frame);
  }

  const std::shared_ptr<FramePool> pool_;
  const int num_threads_;
  std::deque<std::pair<double, Schedule::Job>> on_their_way_;
};

TEST(Schedule, ShowsEachMomentsFrameWhileItPlays) {
  Simulation simulation;
  simulation.schedule.timeline().SetPlaying(true, simulation.now);
  for (int k = 0; k < 60; ++k) simulation.Poll();
  for (int k = 0; k < 60; ++k) {
    const FramePtr shown = simulation.Poll();
    ASSERT_NE(shown, nullptr);
    EXPECT_NEAR(shown->facts.time_s, simulation.schedule.timeline().TimeAt(simulation.now),
                kMoment_s + 1e-6);
  }
  EXPECT_EQ(simulation.schedule.counts().num_missed, 0);
  // Half a second ahead, nothing twice.
  EXPECT_LE(simulation.num_jobs, 120 + 31);
}

TEST(Schedule, WhatIsSetBeforeTheFirstPollBeginsWithIt) {
  Schedule schedule(kDuration_s, {kFramesPerSecond, 0.5});
  BlendSpec blend;
  blend.weights = {0.0};
  schedule.SetBlend(blend, 0.0, schedule.now());
  blend.weights = {1.0};
  schedule.SetBlend(blend, 1.0, schedule.now());
  schedule.timeline().SetPlaying(true, schedule.now());
  EXPECT_FALSE(schedule.Next(0.01).has_value());
  constexpr double kClock = 73'000.0;  // of a machine that runs for long
  schedule.Advance(kClock);
  const auto job = schedule.Next(0.01);
  ASSERT_TRUE(job.has_value());
  EXPECT_NEAR(job->spec.time_s, 0.02, 0.02);
  EXPECT_NEAR(job->spec.blend.weights[0], 0.02, 0.02);
  EXPECT_NEAR(schedule.timeline().TimeAt(kClock + 1.0), 1.0, 1e-9);
}

TEST(Schedule, AGapOfTheNetworkUpToTheLookAheadIsNotSeen) {
  Simulation simulation;
  simulation.schedule.timeline().SetPlaying(true, simulation.now);
  for (int k = 0; k < 90; ++k) simulation.Poll();
  const ScheduleCounts before = simulation.schedule.counts();
  simulation.is_stopped = true;
  for (int k = 0; k < 24; ++k) simulation.Poll();  // 0.4 s
  simulation.is_stopped = false;
  for (int k = 0; k < 60; ++k) simulation.Poll();
  EXPECT_EQ(simulation.schedule.counts().num_missed, 0);
  EXPECT_EQ(simulation.schedule.counts().num_shown - before.num_shown, 84);
}

TEST(Schedule, GoesOnAfterALongGap) {
  Simulation simulation;
  simulation.schedule.timeline().SetPlaying(true, simulation.now);
  for (int k = 0; k < 90; ++k) simulation.Poll();
  simulation.is_stopped = true;
  for (int k = 0; k < 60; ++k) simulation.Poll();
  simulation.is_stopped = false;
  for (int k = 0; k < 10; ++k) simulation.Poll();
  const int64_t missed = simulation.schedule.counts().num_missed;
  EXPECT_GT(missed, 20);
  for (int k = 0; k < 60; ++k) simulation.Poll();
  EXPECT_EQ(simulation.schedule.counts().num_missed, missed);
}

TEST(Schedule, BackwardsAndAcrossTheSeamOfALoopNothingIsMissed) {
  for (const double rate : {-1.0, 1.0, 2.5}) {
    Simulation simulation;
    Timeline& timeline = simulation.schedule.timeline();
    timeline.SetLoop(true, simulation.now);
    timeline.SetRate(rate, simulation.now);
    timeline.SetPlaying(true, simulation.now);
    for (int k = 0; k < 600; ++k) simulation.Poll();
    EXPECT_EQ(simulation.schedule.counts().num_missed, 0) << rate;
    EXPECT_GT(simulation.schedule.counts().num_shown, 590) << rate;
  }
}

TEST(Schedule, AKnownCourseOfTheBlendIsGotAhead) {
  Simulation simulation;
  simulation.schedule.timeline().SetPlaying(true, simulation.now);
  for (int k = 0; k < 60; ++k) simulation.Poll();
  simulation.Weigh(1.0, 1.0);
  double weight = 0.0;
  for (int k = 0; k < 75; ++k) {
    const FramePtr shown = simulation.Poll();
    ASSERT_GE(shown->facts.weights[0], weight - 1e-9);
    weight = shown->facts.weights[0];
  }
  EXPECT_EQ(weight, 1.0);
  EXPECT_EQ(simulation.schedule.counts().num_missed, 0);
}

TEST(Schedule, WeightsThatChangeEveryFrameAreShownSoonAndCostNoMoreThanTwiceTheFrames) {
  Simulation simulation;
  simulation.schedule.timeline().SetPlaying(true, simulation.now);
  for (int k = 0; k < 60; ++k) simulation.Poll();
  const int before = simulation.num_jobs;
  for (int k = 0; k < 120; ++k) {
    simulation.Weigh(k / 120.0, 0.0);
    const FramePtr shown = simulation.Poll();
    if (k > 10) {
      EXPECT_GE(shown->facts.weights[0], (k - 6) / 120.0) << k;
    }
  }
  EXPECT_EQ(simulation.schedule.counts().num_missed, 0);
  EXPECT_LE(simulation.num_jobs - before, 2 * 120);
}

TEST(Schedule, WeightsThatAreSetEachFrameToWhatTheyAreKeepTheLookAhead) {
  Simulation simulation;
  simulation.schedule.timeline().SetPlaying(true, simulation.now);
  const auto poll = [&] {
    simulation.Weigh(0.5, 0.0);
    simulation.Poll();
  };
  for (int k = 0; k < 90; ++k) poll();
  simulation.is_stopped = true;
  for (int k = 0; k < 24; ++k) poll();
  simulation.is_stopped = false;
  for (int k = 0; k < 60; ++k) poll();
  EXPECT_EQ(simulation.schedule.counts().num_missed, 0);
}

TEST(Schedule, AFrameThatComesAfterAChangeToParametersIsNoTrouble) {
  Simulation simulation;
  simulation.latency_s = 0.1;
  simulation.schedule.timeline().SetPlaying(true, simulation.now);
  for (int k = 0; k < 3; ++k) simulation.Poll();
  BlendSpec point;
  point.parameters = {{"height", 2.0}};
  simulation.schedule.SetBlend(point, 0.5, simulation.schedule.now());
  for (int k = 0; k < 60; ++k) simulation.Poll();
  simulation.Weigh(0.5, 0.5);
  FramePtr shown;
  for (int k = 0; k < 60; ++k) shown = simulation.Poll();
  EXPECT_EQ(shown->facts.weights, std::vector<double>{0.5});
}

TEST(Schedule, WhilePausedAFinerLevelReplacesACoarseFrame) {
  Simulation simulation;
  FrameSpec form;
  form.surface.level_of_detail = 2;
  simulation.schedule.SetForm(form);
  for (int k = 0; k < 10; ++k) simulation.Poll();
  EXPECT_EQ(simulation.num_jobs, 1);
  form.surface.level_of_detail = 0;
  simulation.schedule.SetForm(form);
  FramePtr shown;
  for (int k = 0; k < 10; ++k) shown = simulation.Poll();
  EXPECT_EQ(simulation.num_jobs, 2);
  EXPECT_EQ(shown->facts.level_of_detail, 0);
}

TEST(Schedule, WhilePausedOneFrameIsGotAndShownAtOnce) {
  Simulation simulation;
  for (int k = 0; k < 30; ++k) simulation.Poll();
  EXPECT_EQ(simulation.num_jobs, 1);
  simulation.schedule.timeline().Seek(2.5, simulation.now);
  FramePtr shown;
  for (int k = 0; k < 3; ++k) shown = simulation.Poll();
  EXPECT_EQ(shown->facts.time_s, 2.5);
  EXPECT_EQ(simulation.num_jobs, 2);
  simulation.Weigh(1.0, 0.0);
  for (int k = 0; k < 3; ++k) shown = simulation.Poll();
  EXPECT_EQ(shown->facts.weights[0], 1.0);
  for (int k = 0; k < 60; ++k) simulation.Poll();
  EXPECT_LE(simulation.num_jobs, 6);
}

TEST(Schedule, ASeekShowsNothingOfTheTimeBeforeIt) {
  Simulation simulation;
  simulation.schedule.timeline().SetPlaying(true, simulation.now);
  for (int k = 0; k < 60; ++k) simulation.Poll();
  simulation.schedule.timeline().Seek(3.0, simulation.now);
  FramePtr shown = simulation.Poll();
  const double kept = shown->facts.time_s;
  for (int k = 0; k < 10; ++k) {
    shown = simulation.Poll();
    EXPECT_TRUE(shown->facts.time_s == kept || shown->facts.time_s >= 3.0);
  }
  EXPECT_GE(shown->facts.time_s, 3.0);
}

TEST(Schedule, FramesThatAlwaysComeLateAreShownAllTheSame) {
  Simulation simulation(0.0, 1);
  simulation.latency_s = 0.2;
  simulation.schedule.timeline().SetPlaying(true, simulation.now);
  std::set<double> times;
  for (int k = 0; k < 120; ++k) {
    simulation.latency_s = k % 2 == 0 ? 0.15 : 0.2;
    const FramePtr shown = simulation.Poll();
    if (shown != nullptr) times.insert(shown->facts.time_s);
  }
  EXPECT_GE(times.size(), 5u);
}

TEST(Schedule, StaysAtTheEnd) {
  Simulation simulation;
  simulation.schedule.timeline().Seek(kDuration_s - 0.1, simulation.now);
  simulation.schedule.timeline().SetPlaying(true, simulation.now);
  FramePtr shown;
  for (int k = 0; k < 60; ++k) shown = simulation.Poll();
  EXPECT_NEAR(shown->facts.time_s, kDuration_s, 1e-9);
  EXPECT_LE(simulation.num_jobs, 9) << "the last frame again and again";
  const int num_jobs = simulation.num_jobs;
  for (int k = 0; k < 60; ++k) simulation.Poll();
  EXPECT_EQ(simulation.num_jobs, num_jobs);
}

}  // namespace
}  // namespace liquidblend::player
