#include "worker/registration/features/rest.h"

#include <gmock/gmock.h>

#include <vector>

#include "tests/worker/registration/fall_testing.h"
#include "worker/registration/features/automatic.h"

namespace liquidblend::registration {
namespace {

using ::testing::HasSubstr;

constexpr double kGravity = 0.12;  // edges per frame squared

struct FallOptions {
  double rest_time = 0.0;  // frames
  double drift = 0.0;      // edges per frame along x
  double gravity = kGravity;
  double noise = 0.0;  // edges; every other height is off by it
  int num_slabs = 24;
  TrackStart start = TrackStart::kFirstFrame;
  double volume = 500;  // of a bubble below 0
};

// A part that falls along -z.
Track Fall(const FallOptions& options) {
  Track track;
  track.start = options.start;
  track.end = TrackEnd::kMerge;
  track.end_time = options.num_slabs;
  track.volume = options.volume;
  for (int slab = 1; slab <= options.num_slabs; ++slab) {
    const double time = slab - 0.5, since = time - options.rest_time;
    Part part{.slab = slab};
    part.centre = {options.drift * time, 5,
                   90 - options.gravity * since * since / 2 + options.noise * (slab % 2), time};
    track.parts.push_back(part);
  }
  return track;
}

Features FeaturesOf(const std::vector<FallOptions>& falls) {
  Features features;
  for (const FallOptions& options : falls) features.tracks.push_back(Fall(options));
  return features;
}

TEST(Rest, IsFoundWhereAllPartsFallFromRest) {
  const mesh::RestReport report =
      FindRest(FeaturesOf({{}, {.num_slabs = 12}}), FeaturesOf({{.num_slabs = 30}}));
  EXPECT_TRUE(report.is_from_rest);
  EXPECT_EQ(report.time_frames, 0);
  EXPECT_EQ(report.reason,
            "detached parts of the first frames fall from rest: 2 of the source, 1 of the target");
}

TEST(Rest, IsTheFirstFrameWithinTheTolerance) {
  for (const double rest_time : {-1.0, 1.0}) {
    const Features falls = FeaturesOf({{.rest_time = rest_time}});
    const mesh::RestReport report = FindRest(falls, falls);
    EXPECT_TRUE(report.is_from_rest) << report.reason;
    EXPECT_EQ(report.time_frames, 0) << rest_time;
  }
}

TEST(Rest, MayBeLongBeforeTheFirstFrame) {
  const mesh::RestReport report = FindRest(FeaturesOf({{.rest_time = -9.5}}),
                                           FeaturesOf({{.rest_time = -10.5, .num_slabs = 30}}));
  EXPECT_TRUE(report.is_from_rest) << report.reason;
  EXPECT_NEAR(report.time_frames, -10, 1e-6);
}

TEST(Rest, DoesNotDependOnWhichWayIsUp) {
  Features falls = FeaturesOf({{}, {.num_slabs = 12}});
  for (Track& track : falls.tracks) {
    for (Part& part : track.parts) {
      part.centre = {5, -part.centre[2], 0, part.centre[3]};
    }
  }
  falls.up = mesh::Up::kMinusY;
  EXPECT_TRUE(FindRest(falls, falls).is_from_rest);
  falls.up = mesh::Up::kY;
  EXPECT_FALSE(FindRest(falls, falls).is_from_rest);
}

TEST(Rest, IsNotFoundWhereAPartMovesOtherwise) {
  const Features falls = FeaturesOf({{}});
  const auto against = [&](const FallOptions& options) {
    const mesh::RestReport of_source = FindRest(FeaturesOf({{}, options}), falls);
    EXPECT_FALSE(of_source.is_from_rest);
    EXPECT_THAT(of_source.reason, HasSubstr("of the source's first frame"));
    const mesh::RestReport of_target = FindRest(falls, FeaturesOf({options}));
    EXPECT_FALSE(of_target.is_from_rest);
    EXPECT_THAT(of_target.reason, HasSubstr("of the target's first frame"));
    return of_target.reason;
  };
  EXPECT_THAT(against({.rest_time = 8}), HasSubstr("is at its highest only 8.0 frames after it"));
  EXPECT_THAT(against({.drift = 0.5}), HasSubstr("moves sideways, by 11.0 mean edges"));
  EXPECT_THAT(against({.gravity = -kGravity}), HasSubstr("does not speed up downwards"));
  EXPECT_THAT(against({.rest_time = -200, .gravity = 0.01}), HasSubstr("at a steady speed"));
  EXPECT_THAT(against({.noise = 8}), HasSubstr("does not fall freely"));
}

TEST(Rest, IsNotFoundWithoutAFallInBoth) {
  const Features falls = FeaturesOf({{}});
  EXPECT_EQ(FindRest(falls, {}).reason, "no detached part of the target's first frame falls");
  EXPECT_EQ(FindRest({}, falls).reason, "no detached part of the source's first frame falls");
  EXPECT_FALSE(FindRest({}, {}).is_from_rest);
}

TEST(Rest, IgnoresPartsThatStayOrThatComeLaterOrThatLiveShortly) {
  const Features falls = FeaturesOf({{}});
  const Features others = FeaturesOf({{},
                                      {.gravity = 1e-4},
                                      {.gravity = -kGravity, .volume = -500},
                                      {.drift = 3, .start = TrackStart::kSplit},
                                      {.rest_time = 20, .num_slabs = 3}});
  EXPECT_TRUE(FindRest(falls, others).is_from_rest) << FindRest(falls, others).reason;
}

TEST(Rest, IsNotFoundWherePartsDisagree) {
  const mesh::RestReport times = FindRest(FeaturesOf({{}}), FeaturesOf({{.rest_time = -6}}));
  EXPECT_FALSE(times.is_from_rest);
  EXPECT_THAT(times.reason, HasSubstr("at rest at different times, 6.0 frames apart"));
  const mesh::RestReport gravity =
      FindRest(FeaturesOf({{}}), FeaturesOf({{.gravity = 1.5 * kGravity}}));
  EXPECT_FALSE(gravity.is_from_rest);
  EXPECT_THAT(gravity.reason, HasSubstr("by a factor of 1.50"));
  const Features brief = FeaturesOf({{.gravity = 1.5 * kGravity, .num_slabs = 7}});
  EXPECT_TRUE(FindRest(FeaturesOf({{}}), brief).is_from_rest) << "too short to tell";
}

TEST(Rest, IsFoundInMeshes) {
  const TestSurface low(DropMesh(FallFrom(1.2))), high(DropMesh(FallFrom(1.6)));
  const TestSurface steady(DropMesh([](double k) { return 1.5 - 0.08 * k; }));
  const Features of_low = FindTrackFeatures(low.surface), of_high = FindTrackFeatures(high.surface);
  EXPECT_TRUE(FindRest(of_low, of_high).is_from_rest) << FindRest(of_low, of_high).reason;
  const Features of_steady = FindTrackFeatures(steady.surface);
  EXPECT_FALSE(FindRest(of_low, of_steady).is_from_rest);
  EXPECT_FALSE(FindRest(of_steady, of_steady).is_from_rest);
}

}  // namespace
}  // namespace liquidblend::registration
