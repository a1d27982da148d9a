#include "client/player/timeline.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace liquidblend::player {
namespace {

using ::testing::DoubleNear;
using ::testing::ElementsAre;

TEST(Timeline, PlaysFromWhereItIsAtTheGivenRate) {
  Timeline timeline(10.0);
  EXPECT_EQ(timeline.TimeAt(123.0), 0.0);
  EXPECT_EQ(timeline.SpeedAt(123.0), 0.0);
  timeline.SetPlaying(true, 100.0);
  EXPECT_DOUBLE_EQ(timeline.TimeAt(101.5), 1.5);
  timeline.SetRate(2.0, 101.5);
  EXPECT_DOUBLE_EQ(timeline.TimeAt(102.5), 3.5);
  EXPECT_EQ(timeline.SpeedAt(102.5), 2.0);
  timeline.SetPlaying(false, 102.5);
  EXPECT_DOUBLE_EQ(timeline.TimeAt(200.0), 3.5);
  EXPECT_EQ(timeline.SpeedAt(200.0), 0.0);
  timeline.Seek(7.0, 200.0);
  timeline.SetPlaying(true, 200.0);
  EXPECT_DOUBLE_EQ(timeline.TimeAt(200.5), 8.0);
}

TEST(Timeline, StopsAtTheEndItComesTo) {
  Timeline timeline(2.0);
  timeline.SetPlaying(true, 0.0);
  EXPECT_EQ(timeline.TimeAt(5.0), 2.0);
  EXPECT_EQ(timeline.SpeedAt(5.0), 0.0);
  timeline.SetRate(-1.0, 5.0);
  EXPECT_EQ(timeline.SpeedAt(5.5), -1.0);
  EXPECT_DOUBLE_EQ(timeline.TimeAt(6.0), 1.0);
  EXPECT_EQ(timeline.TimeAt(9.0), 0.0);
  EXPECT_EQ(timeline.SpeedAt(9.0), 0.0);
}

TEST(Timeline, LoopsForwardAndBackward) {
  Timeline timeline(2.0);
  timeline.SetLoop(true, 0.0);
  timeline.SetPlaying(true, 0.0);
  EXPECT_DOUBLE_EQ(timeline.TimeAt(2.5), 0.5);
  EXPECT_DOUBLE_EQ(timeline.TimeAt(7.0), 1.0);
  timeline.SetRate(-1.0, 2.5);
  EXPECT_NEAR(timeline.TimeAt(3.5), 1.5, 1e-12);
  EXPECT_EQ(timeline.SpeedAt(30.0), -1.0);
  Timeline still(0.0);  // one frame
  still.SetLoop(true, 0.0);
  still.SetPlaying(true, 0.0);
  EXPECT_EQ(still.TimeAt(3.0), 0.0);
  EXPECT_EQ(still.SpeedAt(3.0), 0.0);
}

TEST(Timeline, SeeksWithinTheAnimation) {
  Timeline timeline(2.0);
  timeline.Seek(5.0, 0.0);
  EXPECT_EQ(timeline.TimeAt(0.0), 2.0);
  timeline.Seek(-1.0, 0.0);
  EXPECT_EQ(timeline.TimeAt(0.0), 0.0);
}

// Whatever a server says, the time is a number and inside.
TEST(Timeline, WithoutADurationHasOneMoment) {
  for (const double duration_s : {-2.0, double{NAN}, double{INFINITY}, -double{INFINITY}}) {
    for (const bool loops : {false, true}) {
      Timeline timeline(duration_s);
      timeline.SetLoop(loops, 0.0);
      timeline.SetPlaying(true, 0.0);
      timeline.Seek(1.0, 1.0);
      EXPECT_EQ(timeline.TimeAt(3.0), 0.0) << duration_s;
      EXPECT_EQ(timeline.SpeedAt(3.0), 0.0) << duration_s;
    }
  }
  Timeline timeline(2.0);
  timeline.Seek(1.0, 0.0);
  timeline.Seek(NAN, 0.0);
  EXPECT_EQ(timeline.TimeAt(0.0), 1.0);
}

BlendSpec Weights(std::vector<double> weights) {
  BlendSpec blend;
  blend.weights = std::move(weights);
  return blend;
}

TEST(BlendCourse, GoesFromWhatItIsToWhatIsAskedFor) {
  BlendCourse course;
  course.Change(Weights({0.0, 1.0}), 0.0, 0.0);
  EXPECT_THAT(course.At(0.0).weights, ElementsAre(0.0, 1.0));
  course.Change(Weights({1.0, 0.0}), 2.0, 10.0);
  EXPECT_THAT(course.At(10.5).weights, ElementsAre(0.25, 0.75));
  EXPECT_FALSE(course.IsSettledAt(11.9));
  course.Change(Weights({0.25, 0.75}), 1.0, 11.0);  // half-way
  EXPECT_THAT(course.At(11.5).weights, ElementsAre(DoubleNear(0.375, 1e-12), 0.625));
  EXPECT_THAT(course.At(12.0).weights, ElementsAre(0.25, 0.75));
  EXPECT_TRUE(course.IsSettledAt(12.0));
}

TEST(BlendCourse, OfAnotherKindIsTheNewOneAtAnyTime) {
  BlendCourse course;
  BlendSpec point;
  point.parameters = {{"height", 2.0}};
  course.Change(Weights({0.5, 0.5}), 0.0, 10.0);
  course.Change(point, 5.0, 20.0);
  EXPECT_EQ(course.At(15.0), point);  // a frame that comes late is asked for again
  course.Change(Weights({0.5, 0.5}), 5.0, 30.0);
  EXPECT_EQ(course.At(25.0), Weights({0.5, 0.5}));
}

TEST(BlendCourse, ChangesAtOnceBetweenWeightsAndParameters) {
  BlendCourse course;
  course.Change(Weights({0.5}), 0.0, 0.0);
  BlendSpec point;
  point.parameters = {{"height", 2.0}};
  course.Change(point, 5.0, 1.0);
  EXPECT_EQ(course.At(1.0), point);
  BlendSpec higher = point;
  higher.parameters["height"] = 4.0;
  course.Change(higher, 1.0, 2.0);
  EXPECT_DOUBLE_EQ(course.At(2.5).parameters.at("height"), 3.0);
}

}  // namespace
}  // namespace liquidblend::player
