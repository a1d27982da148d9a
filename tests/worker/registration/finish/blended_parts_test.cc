#include "worker/registration/finish/blended_parts.h"

#include <gtest/gtest.h>

#include "tests/worker/registration/drops_testing.h"
#include "tests/worker/registration/fall_testing.h"
#include "worker/registration/features/automatic.h"

namespace liquidblend::registration::blended_parts_test {
namespace {

// Two animations of one drop.
struct Drops {
  Drops(mesh::SpaceTimeMesh a, mesh::SpaceTimeMesh b)
      : source(std::move(a)),
        target(std::move(b)),
        of_source(FindTrackFeatures(source.surface)),
        of_target(FindTrackFeatures(target.surface)),
        parts(PartsOfBoth(of_source, of_target, {{0, 0, 1.0}})) {}

  Points Unmoved() const { return Points::Zero(4, source.surface.points.cols()); }
  // The drop's vertices moved sideways, the pool's where they are.
  Points Moved(double metres) const {
    Points displacement = Unmoved();
    for (int64_t v = 0; v < displacement.cols(); ++v) {
      if (of_source.track_of[v] == 0) {
        displacement(0, v) = static_cast<float>(metres / source.mesh.edge_length_m);
      }
    }
    return displacement;
  }
  PartErrors Errors(const Points& displacement, int num_threads = 2) const {
    return CompareParts(source.surface, displacement, parts, parallel::Arena(num_threads));
  }

  TestSurface source, target;
  Features of_source, of_target;
  std::vector<PartOfBoth> parts;
};

Drops SideBySide() { return {Scene({DropAt(-0.5, 0.8)}), Scene({DropAt(0.5, 0.8)})}; }

TEST(CompareParts, ADropHalfWayBetweenHasNoErrors) {
  const Drops drops = SideBySide();
  ASSERT_EQ(drops.parts.size(), 1u);
  const PartErrors errors = drops.Errors(drops.Moved(1));
  EXPECT_LT(errors.shift.value, 0.1);
  EXPECT_LT(errors.volume.value, 0.05);
}

TEST(CompareParts, ADropThatStaysWhereItIsIsFarOff) {
  const Drops drops = SideBySide();
  const PartErrors errors = drops.Errors(drops.Unmoved());
  EXPECT_EQ(errors.shift.value, 1);
  const double edge_m = drops.source.mesh.edge_length_m;
  EXPECT_GT(edge_m * errors.shift.place[0], -0.3) << "where it should be";
  EXPECT_LT(edge_m * errors.shift.place[0], 0.3);
}

TEST(CompareParts, ADropThatGrowsIsTooLarge) {
  const Drops drops = SideBySide();
  const float factor = 1.2f;  // of its diameter at weight 1
  Points displacement = drops.Moved(1);
  for (int64_t v = 0; v < displacement.cols(); ++v) {
    if (drops.of_source.track_of[v] != 0) continue;
    const Eigen::Vector4f point = drops.source.surface.points.col(v);
    const Part part = drops.parts[0].source.At(point[3]);
    displacement.col(v).head<3>() +=
        (factor - 1) * (point.head<3>() - part.centre.head<3>().cast<float>());
  }
  const double at_three_quarters = std::pow(1 + 0.75 * (factor - 1), 3) - 1;
  EXPECT_NEAR(drops.Errors(displacement).volume.value, at_three_quarters, 0.06);
}

TEST(CompareParts, ADropThatFallsInSlowMotionHasAnotherAcceleration) {
  const Drops drops(DropMesh(FallFrom(1.6)), DropMesh(FallFrom(1.6)));
  EXPECT_LT(drops.Errors(drops.Unmoved()).fall.value, 0.1);
  const float slower = 1.3f;  // at weight 1
  Points displacement = drops.Unmoved();
  displacement.row(3) = (slower - 1) * drops.source.surface.points.row(3);
  const double at_three_quarters = 1 - 1 / std::pow(1 + 0.75 * (slower - 1), 2);
  EXPECT_NEAR(drops.Errors(displacement).fall.value, at_three_quarters, 0.1);
}

TEST(CompareParts, HasTheSameBytesForAnyNumberOfThreads) {
  const Drops drops = SideBySide();
  const PartErrors one = drops.Errors(drops.Moved(0.8), 1);
  for (const int num_threads : {2, 8}) {
    const PartErrors other = drops.Errors(drops.Moved(0.8), num_threads);
    EXPECT_EQ(other.shift.value, one.shift.value);
    EXPECT_EQ(other.volume.value, one.volume.value);
    EXPECT_EQ(other.shift.place, one.shift.place);
  }
}

TEST(PartsOfBoth, AreThoseThatAreThereFromTheFirstFrameOnAndEndAlike) {
  Features source, target;
  Track fall;
  fall.end = TrackEnd::kMerge;
  fall.end_time = 10;
  Track brief = fall, splash = fall, lasting = fall;
  brief.end_time = 2;
  splash.start = TrackStart::kSplit;
  lasting.end = TrackEnd::kLastFrame;
  source.tracks = {fall, brief, splash, lasting};
  target.tracks = {fall, fall, fall, fall};
  EXPECT_EQ(PartsOfBoth(source, target, {{0, 0, 1}, {1, 1, 1}, {2, 2, 1}, {3, 3, 1}}).size(), 1u);
}

}  // namespace
}  // namespace liquidblend::registration::blended_parts_test
