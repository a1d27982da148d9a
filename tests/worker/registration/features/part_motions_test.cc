#include "worker/registration/features/part_motions.h"

#include <gmock/gmock.h>

#include <numbers>
#include <utility>
#include <vector>

#include "core/mesh/components.h"
#include "core/mesh/slice_at.h"
#include "tests/worker/registration/drops_testing.h"
#include "worker/registration/features/automatic.h"
#include "worker/registration/finish/part_slip.h"
#include "worker/registration/finish/part_volumes.h"

namespace liquidblend::registration {
namespace {

constexpr double kReach = 5.0;
const FeaturePairs kOnePair = {.tracks = {{0, 0, 1.0}}, .extrema = {}};

// A ball that falls steadily along z from 80 on.
Track Fall(double edges_per_frame, int num_slabs, TrackEnd end = TrackEnd::kMerge) {
  Track track;
  track.end = end;
  track.end_time = num_slabs;
  track.volume = 4.0 / 3 * std::numbers::pi * kReach * kReach * kReach;
  for (int slab = 1; slab <= num_slabs; ++slab) {
    Part part{.slab = slab};
    part.centre = {1, 2, 80 - edges_per_frame * (slab - 0.5), slab - 0.5};
    part.reach.fill(kReach);
    // The lowest vertex is of the slab's end.
    part.reach[1] = kReach + 0.5 * edges_per_frame;
    track.parts.push_back(part);
  }
  return track;
}

TEST(PartMotions, EndWhereBothPartsHaveComeEquallyLow) {
  // Both strike at a height of 20: after 15 frames, and after 7.5, of which 7 are whole.
  const auto motion = PartMotionOf(Fall(4, 15), Fall(8, 7));
  ASSERT_TRUE(motion.has_value());
  EXPECT_NEAR(motion->time_scale, 0.5, 1e-9);
  EXPECT_NEAR(motion->time_offset, 0, 1e-9);
  EXPECT_NEAR(motion->scale, 1, 1e-9);
}

TEST(PartMotions, AreOnlyOfPartsThatEndByAMergeInBoth) {
  EXPECT_FALSE(PartMotionOf(Fall(4, 15), Fall(4, 15, TrackEnd::kLastFrame)).has_value());
  EXPECT_FALSE(PartMotionOf(Fall(4, 15, TrackEnd::kVanishes), Fall(4, 15)).has_value());
  EXPECT_FALSE(PartMotionOf(Fall(4, 1), Fall(4, 15)).has_value()) << "there for a frame";
}

TEST(PartMotions, ExpectAPointAtItsPlaceInThePartAndItsNormalOnTheMovingSurface) {
  const auto motion = PartMotionOf(Fall(4, 15), Fall(8, 7));
  ASSERT_TRUE(motion.has_value());
  // The lowest point at frame 6: n = (0, 0, -1), and -v.n in time.
  const Eigen::Vector4f point(1, 2, 80 - 24 - 5, 6);
  const Eigen::Vector4f normal = Eigen::Vector4f(0, 0, -1, -4).normalized();
  const Expected expected = ExpectedOn(*motion, point, normal);
  EXPECT_LT((expected.point - Eigen::Vector4f(1, 2, 80 - 24 - 5, 3)).norm(), 1e-3);
  EXPECT_LT((expected.normal - Eigen::Vector4f(0, 0, -1, -8).normalized()).norm(), 1e-3);
}

// The same with a constant acceleration from rest.
Track FreeFallOf(double edges_per_frame_squared, int num_slabs) {
  Track track = Fall(0, num_slabs);
  for (Part& part : track.parts) {
    part.centre[2] -= edges_per_frame_squared * part.centre[3] * part.centre[3] / 2;
  }
  return track;
}

TEST(PartMotions, WithTimesBlendedLinearlyFallsOfUnlikeLengthsAreTooFastHalfWay) {
  const auto acceleration = [](const Track& source, const Track& target) {
    const auto motion = PartMotionOf(source, target);
    EXPECT_TRUE(motion.has_value());
    return AccelerationHalfWay(*motion, mesh::Up::kZ);
  };
  EXPECT_NEAR(acceleration(FreeFallOf(0.2, 16), FreeFallOf(0.2, 16)), 1, 1e-3);
  // Mean of x^2 over square of the mean: (1 + 9) / 2 / 2^2. Ends are known to a frame.
  EXPECT_NEAR(acceleration(FreeFallOf(0.2, 8), FreeFallOf(0.2, 24)), 1.25, 0.05);
  EXPECT_NEAR(acceleration(FreeFallOf(0.2, 24), FreeFallOf(0.2, 8)), 1.25, 0.05);
  EXPECT_EQ(acceleration(Fall(4, 8), Fall(4, 24)), 1) << "at a steady speed";
}

TEST(PartMotions, OfFallsThatAreTooFastHalfWayAreTakenOnlyIfTimesBlendAsSquares) {
  const auto count = [](int num_slabs, TimesBlend times) {
    Features source, target;
    source.tracks = {FreeFallOf(0.2, 10)};
    target.tracks = {FreeFallOf(0.2, num_slabs)};
    return PartMotions(source, target, kOnePair, {}, 1.0, times).all().size();
  };
  EXPECT_EQ(count(15, TimesBlend::kLinearly), 1u);
  EXPECT_EQ(count(30, TimesBlend::kLinearly), 0u);
  EXPECT_EQ(count(30, TimesBlend::kAsSquares), 1u);
}

TEST(PartMotions, TellTheLivesOfPartsThatAreDetachedInBothFirstFrames) {
  constexpr double kEdgeM = 0.1;
  const auto lives = [&](Track source, Track target) {
    Features from, to;
    from.tracks = {std::move(source)};
    to.tracks = {std::move(target)};
    return PartMotions(from, to, kOnePair, {}, kEdgeM, TimesBlend::kLinearly).lives();
  };
  const std::vector<mesh::PartLife> fall = lives(Fall(4, 15), Fall(8, 7));
  ASSERT_EQ(fall.size(), 1u);
  EXPECT_THAT(fall[0].source_start_m, testing::ElementsAre(0.1F, 0.2F, 7.8F));
  EXPECT_EQ(fall[0].source_end_frames, 15);
  EXPECT_NEAR(fall[0].target_end_frames, 7.5, 1e-9);
  EXPECT_EQ(lives(FreeFallOf(0.2, 8), FreeFallOf(0.2, 24)).size(), 1u) << "which has no motion";
  Track splash = Fall(4, 15);
  splash.start = TrackStart::kSplit;
  EXPECT_TRUE(lives(splash, Fall(8, 7)).empty());
  EXPECT_TRUE(lives(Fall(8, 7), splash).empty());
}

TEST(PartMotions, APartThatIsJoinedInTheTargetEndsAtItsStart) {
  const Track fall = Fall(4, 10);  // from a height of 80
  const Lump from = {.place = {1, 2}, .height = 85}, to = {.place = {4, 6}, .height = 45};
  const auto motion = MotionToStart(fall, from, to, mesh::Up::kZ);
  ASSERT_TRUE(motion.has_value());
  const Eigen::Vector4f normal(0, 0, 1, 0);
  // The top, in the first frame and half-way to the strike.
  const Eigen::Vector4f first = ExpectedOn(*motion, {1, 2, 85, 0}, normal).point;
  EXPECT_LT((first - Eigen::Vector4f(4, 6, 45, 0)).norm(), 1e-3);
  const Eigen::Vector4f later = ExpectedOn(*motion, {1, 2, 65, 5}, normal).point;
  EXPECT_LT((later - Eigen::Vector4f(4, 6, 45, 0.25)).norm(), 1e-3);
  Features source, target;
  source.tracks = {fall};
  source.lumps = {from};
  target.lumps = {to};
  FeaturePairs joined;
  joined.joined.source = {{.track = 0, .own_lump = 0, .other_lump = 0}};
  const PartMotions motions(source, target, joined, {}, 1.0, TimesBlend::kLinearly);
  ASSERT_EQ(motions.all().size(), 1u);
  EXPECT_TRUE(motions.lives().empty()) << "it may end before the first frame";
  EXPECT_FALSE(MotionToStart(Fall(4, 10, TrackEnd::kLastFrame), from, to, mesh::Up::kZ));
  EXPECT_FALSE(MotionToStart(Fall(4, 1), from, to, mesh::Up::kZ));
}

class PartMotionsOfScenes : public ::testing::Test {
 protected:
  PartMotions Find(const std::vector<Correspondence>& users) const {
    return PartMotions(source_features_, target_features_, kOnePair, users,
                       source_.mesh.edge_length_m, TimesBlend::kLinearly);
  }
  TestSurface source_{Scene({DropAt(-0.2, 0.8)}, 0.6)};
  const mesh::SpaceTimeMesh target_mesh_ = Scene({DropAt(0.1, 0.6)}, 0.6);
  const Surface target_{target_mesh_, source_.mesh.edge_length_m, parallel::Arena(2)};
  const Features source_features_ = FindTrackFeatures(source_.surface);
  const Features target_features_ = FindTrackFeatures(target_);
};

TEST_F(PartMotionsOfScenes, AreOfTheDropsVerticesAndOfNoOthers) {
  const PartMotions motions = Find({});
  ASSERT_EQ(motions.all().size(), 1u);
  const double edge = source_.mesh.edge_length_m;
  int64_t num_of_drop = 0;
  for (int64_t v = 0; v < source_.surface.points.cols(); ++v) {
    if (motions.Of(v) == nullptr) continue;
    ++num_of_drop;
    const Eigen::Vector4d p = source_.surface.points.col(v).cast<double>();
    const Eigen::Vector3d centre(-0.2, 0, 0.8 - 0.05 * p[3]);
    ASSERT_NEAR((edge * p.head<3>() - centre).norm(), kDropRadius, edge) << v;
  }
  EXPECT_GT(num_of_drop, 500);
  int64_t num_of_target = 0;
  for (int64_t v = 0; v < target_.points.cols(); ++v) num_of_target += motions.HasTarget(v);
  EXPECT_GT(num_of_target, 300);
  EXPECT_LT(num_of_target, target_.points.cols() / 2);
}

TEST_F(PartMotionsOfScenes, AUserWhoSendsAPointElsewhereKnowsBetter) {
  Correspondence user;
  user.source = {-0.2, 0, 1.05, 0};
  user.target = {0.1, 0, 0.85, 0};
  EXPECT_EQ(Find({user}).all().size(), 1u) << "top to top";
  user.target = {0.1, 0, 0.55, 6};
  EXPECT_TRUE(Find({user}).all().empty()) << "much later";
  user.target = {0.5, 0.3, 0, 0};
  EXPECT_TRUE(Find({user}).all().empty()) << "into the pool";
  user.source = {0.5, 0.3, 0, 0};
  EXPECT_EQ(Find({user}).all().size(), 1u) << "of the pool";
}

TEST_F(PartMotionsOfScenes, AUsersPointsAtTheStrikeMayBeAFrameLate) {
  const PartMotions motions = Find({});
  ASSERT_EQ(motions.all().size(), 1u);
  const Track &from = motions.all()[0].source, &to = motions.all()[0].target;
  const auto top = [&](const Track& track, double time) -> Eigen::Vector4d {
    const double edge = source_.mesh.edge_length_m;
    Eigen::Vector4d point = track.At(time).centre;
    point.head<3>() *= edge;
    point[2] += kDropRadius;
    point[3] = time;
    return point;
  };
  Correspondence user;
  user.source = top(from, from.end_time - 0.5);
  user.target = top(to, to.end_time + 0.5);
  EXPECT_EQ(Find({user}).all().size(), 1u) << "the target a little late";
  user.source = top(from, from.end_time + 0.5);
  user.target = top(to, to.end_time - 0.5);
  EXPECT_EQ(Find({user}).all().size(), 1u) << "the source a little late";
  user.target = {0.5, 0.3, 0, to.end_time};
  EXPECT_EQ(Find({user}).all().size(), 1u) << "after its end, of the pool";
}

// Displacement by which each vertex of the drop goes to where its motion expects it, but turned
// about the drop's centre, and early on one side and late on the other one.
TEST_F(PartMotionsOfScenes, PartsThatHaveSlippedKeepTheirVolumeHalfWay) {
  const PartMotions motions = Find({});
  ASSERT_EQ(motions.parts().size(), 1u);
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.5, Eigen::Vector3d(1, 1, 0).normalized()).toRotationMatrix();
  Points displacement = Points::Zero(4, source_.surface.points.cols());
  for (int64_t v = 0; v < displacement.cols(); ++v) {
    const PartMotion* const motion = motions.Of(v);
    ASSERT_EQ(motion != nullptr, motions.PartOf(v) == 0) << v;
    if (motion == nullptr) continue;
    const Eigen::Vector4f p = source_.surface.points.col(v);
    const Eigen::Vector3d from_centre =
        (p.cast<double>() - motion->source.At(p[3]).centre).head<3>();
    const bool is_fixed = source_.surface.InFirstSlab(v);
    const double target_time = p[3] * motion->time_scale + motion->time_offset +
                               (is_fixed ? 0.0 : 0.1 * std::sin(from_centre[0]));
    const Eigen::Vector3d to = motion->target.At(target_time).centre.head<3>();
    Eigen::Vector4d image;
    image << to + turn * from_centre, is_fixed ? 0.0 : target_time;
    displacement.col(v) = image.cast<float>() - p;
  }
  const auto volume = [&](double weight, double frame) {
    Eigen::Matrix4Xf moved = static_cast<float>(weight) * displacement;
    moved.topRows<3>() *= static_cast<float>(source_.mesh.edge_length_m);
    moved += source_.mesh.vertices;
    const double times[] = {frame};
    const auto slices = mesh::SliceAt(source_.mesh, moved, times, parallel::Arena(2));
    return mesh::ComponentVolumes(slices.front()).back();
  };
  const double times[] = {0.5, 1, 1.5};
  const double whole = volume(0, 1);
  for (const double time : times) EXPECT_LT(volume(0.5, time), 0.95 * whole) << time;
  const double target_before = volume(1, 1);
  const Points before = displacement;
  RemovePartSlip(source_.surface, source_.neighbors, motions, parallel::Arena(2), displacement);
  for (const double time : times) EXPECT_NEAR(volume(0.5, time) / whole, 1, 0.01) << time;
  EXPECT_NEAR(volume(1, 1) / target_before, 1, 0.01);
  for (int64_t v = 0; v < displacement.cols(); ++v) {
    ASSERT_TRUE(!source_.surface.InFirstSlab(v) || displacement(3, v) == before(3, v)) << v;
    ASSERT_TRUE(motions.PartOf(v) == 0 || displacement.col(v) == before.col(v)) << v;
  }
  for (const int num_threads : {1, 8}) {
    Points again = before;
    RemovePartSlip(source_.surface, source_.neighbors, motions, parallel::Arena(num_threads),
                   again);
    EXPECT_TRUE(again == displacement) << num_threads << " threads";
  }
}

TEST_F(PartMotionsOfScenes, PartsGetTheTargetsVolumes) {
  const PartMotions motions = Find({});
  ASSERT_EQ(motions.all().size(), 1u);
  // Each vertex where its motion expects it, in a part a twentieth too large.
  Points displacement = Points::Zero(4, source_.surface.points.cols());
  for (int64_t v = 0; v < displacement.cols(); ++v) {
    const PartMotion* const motion = motions.Of(v);
    if (motion == nullptr) continue;
    const Eigen::Vector4f p = source_.surface.points.col(v);
    const Part part = motion->source.At(p[3]);
    Eigen::Vector4f large = p;
    large.head<3>() += 0.05f * (p.head<3>() - part.centre.head<3>().cast<float>());
    displacement.col(v) = ExpectedOn(*motion, large, source_.mesh.normals.col(v)).point - p;
    if (source_.surface.InFirstSlab(v)) displacement(3, v) = 0;
  }
  const double times[] = {1, 2, 3};
  const auto error = [&](int frame) {
    Eigen::Matrix4Xf moved = displacement;
    moved.topRows<3>() *= static_cast<float>(source_.mesh.edge_length_m);
    moved += source_.mesh.vertices;
    const auto volume = [&](const mesh::TriangleMesh& slice) {
      return mesh::ComponentVolumes(slice).back();
    };
    const parallel::Arena arena(2);
    return volume(mesh::SliceAt(source_.mesh, moved, times, arena)[frame]) /
               volume(mesh::SliceAt(target_mesh_, times, arena)[frame]) -
           1;
  };
  for (const int frame : {0, 1, 2}) EXPECT_GT(error(frame), 0.1) << frame;
  const Points before = displacement;
  MatchPartVolumes(source_.surface, source_.neighbors, target_, motions, parallel::Arena(2),
                   displacement);
  for (const int frame : {0, 1, 2}) EXPECT_NEAR(error(frame), 0, 0.01) << frame;
  for (const int num_threads : {1, 8}) {
    Points again = before;
    MatchPartVolumes(source_.surface, source_.neighbors, target_, motions,
                     parallel::Arena(num_threads), again);
    EXPECT_TRUE(again == displacement) << num_threads << " threads";
  }
}

}  // namespace
}  // namespace liquidblend::registration
