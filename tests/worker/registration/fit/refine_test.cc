#include "worker/registration/fit/refine.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "tests/worker/registration/registration_testing.h"
#include "worker/registration/register.h"

namespace liquidblend::registration::refine_test {
namespace {

using ::testing::HasSubstr;

class RefineTest : public ::testing::Test {
 protected:
  static Correspondence PointAt(double height_m) {
    Correspondence c;
    c.source = {2.0 / 24, 0, height_m, 2};
    c.target = {2.0 / 24, 0, height_m, 2};
    return c;
  }

  TestSurface sphere_{SphereMesh()};
  DeformationNodes nodes_{sphere_.surface.points, sphere_.neighbors, 4.0, {}, 1,
                          parallel::Arena(2)};
};

TEST_F(RefineTest, FittedMapsGiveBackASmoothDisplacement) {
  const Points& rest = sphere_.surface.points;
  Points displacement(4, rest.cols());
  for (int64_t v = 0; v < rest.cols(); ++v) {
    const Eigen::Vector4f p = rest.col(v);
    displacement.col(v) << 3 + std::sin(0.2f * p.y()), 0.3f * p.x(), -1, 0.2f * p.z();
  }
  const auto maps = FitMaps(nodes_, rest, sphere_.neighbors, displacement, 4.0, parallel::Arena(2));
  const Points fitted = Deform(nodes_, maps, rest, parallel::Arena(2)) - rest;
  EXPECT_LT((fitted - displacement).colwise().norm().maxCoeff(), 0.15f);
  EXPECT_EQ(FitMaps(nodes_, rest, sphere_.neighbors, displacement, 4.0, parallel::Arena(1)), maps);
}

TEST_F(RefineTest, MapsOfASpeckOfOneVertexAreFinite) {
  const Points rest = Points::Zero(4, 1);
  const PackedLists alone(1, parallel::Arena(1), [](int64_t, std::vector<int32_t>&) {});
  const DeformationNodes node(rest, alone, 4.0, {}, 1, parallel::Arena(1));
  const Points displacement = Points::Constant(4, 1, 2.0f);
  const auto maps = FitMaps(node, rest, alone, displacement, 4.0, parallel::Arena(1));
  ASSERT_EQ(maps.size(), 1u);
  EXPECT_TRUE(maps[0].allFinite());
  EXPECT_EQ(Eigen::Vector4f(maps[0].col(4)), Eigen::Vector4f::Constant(2.0f));
}

TEST_F(RefineTest, ChangedAreAddedRemovedAndAltered) {
  const auto changed = [&](const std::vector<Correspondence>& before,
                           const std::vector<Correspondence>& now) {
    const auto pins =
        ChangedPins(before, now, sphere_.surface, sphere_.surface, parallel::Arena(2));
    EXPECT_TRUE(pins.ok()) << pins.status();
    return pins->size();
  };
  const Correspondence top = PointAt(0.5), bottom = PointAt(-0.5);
  Correspondence harder = top;
  harder.hard = true;
  EXPECT_EQ(changed({top, bottom}, {bottom, top}), 0u);
  EXPECT_EQ(changed({top}, {top, bottom}), 1u);
  EXPECT_EQ(changed({top, bottom}, {bottom}), 1u);
  EXPECT_EQ(changed({top}, {harder}), 2u);
}

TEST_F(RefineTest, ClosenessFallsToZeroAtTheRadius) {
  const Points& rest = sphere_.surface.points;
  const Pin pin{nodes_.vertex(0), Eigen::Vector4f::Zero(), true, true, 0};
  const std::vector<float> closeness = ClosenessToPins(nodes_, rest, {pin}, 6.0);
  EXPECT_EQ(closeness[0], 1.0f);
  int num_far = 0;
  for (int64_t n = 0; n < nodes_.num_nodes(); ++n) {
    const float distance = (nodes_.position(n) - nodes_.position(0)).norm();
    EXPECT_EQ(closeness[n] == 0.0f, distance >= 6.0f);
    num_far += distance >= 6.0f ? 1 : 0;
  }
  EXPECT_GT(num_far, 0);
}

// A drop that falls into a pool from this height.
mesh::SpaceTimeMesh Drop(double height_m) {
  synthetic::FallingDropOptions options;
  options.drop_m[2] = static_cast<float>(height_m);
  options.spacing_m = 0.1;
  options.num_frames = 10;
  return BuildMesh(synthetic::FallingDrop(options));
}

class RefinedDropsTest : public ::testing::Test {
 protected:
  static RegistrationOptions Options() {
    RegistrationOptions options;
    options.sample_share = 0.2;  // the meshes are small
    options.max_iterations = 12;
    return options;
  }
  // The tops of the drops at frame 3.
  static Correspondence Tops() {
    Correspondence c;
    c.hard = true;
    c.source = {0, 0, 0.65, 3};
    c.target = {0.05, 0, 0.95, 3};
    return c;
  }
  absl::StatusOr<Registration> FromScratch(const std::vector<Correspondence>& list) const {
    return Register(source_, target_, list, Options(), parallel::Arena(2));
  }
  absl::StatusOr<Registration> Refined(const Registration& previous,
                                       const std::vector<Correspondence>& before,
                                       const std::vector<Correspondence>& now,
                                       int num_threads = 2) const {
    return Refine(source_, target_, now, {previous.displacement, before}, Options(),
                  parallel::Arena(num_threads));
  }

  mesh::SpaceTimeMesh source_ = Drop(0.45);
  mesh::SpaceTimeMesh target_ = Drop(0.75);
};

TEST_F(RefinedDropsTest, AddingAndRemovingIsAsGoodAsFromScratchInFewerIterations) {
  const auto before = FromScratch({});
  const auto scratch = FromScratch({Tops()});
  ASSERT_TRUE(before.ok() && scratch.ok()) << before.status() << scratch.status();
  const auto added = Refined(*before, {}, {Tops()});
  ASSERT_TRUE(added.ok()) << added.status();
  EXPECT_EQ(added->report.num_iterations, 6);
  EXPECT_LT(added->report.correspondences.at(0).residual_m, 1e-3 * source_.edge_length_m);
  const auto removed = Refined(*scratch, {Tops()}, {});
  ASSERT_TRUE(removed.ok()) << removed.status();
  EXPECT_LT(added->report.mean_residual_edges, 1.1 * scratch->report.mean_residual_edges);
  EXPECT_LT(removed->report.mean_residual_edges, 1.1 * before->report.mean_residual_edges);
}

TEST_F(RefinedDropsTest, SameBytesAtAnyThreadCount) {
  Registration previous;
  previous.displacement = Eigen::Matrix4Xf::Zero(4, source_.num_vertices());
  const auto one = Refined(previous, {}, {Tops()}, 1);
  const auto many = Refined(previous, {}, {Tops()}, 8);
  ASSERT_TRUE(one.ok() && many.ok()) << one.status() << many.status();
  EXPECT_EQ(one->displacement, many->displacement);
  EXPECT_EQ(one->extrapolation, many->extrapolation);
}

TEST_F(RefinedDropsTest, RefusesADisplacementOfAnotherMeshOrThatIsNotFinite) {
  Registration previous;
  previous.displacement = Eigen::Matrix4Xf::Zero(4, 5);
  EXPECT_THAT(Refined(previous, {}, {}).status().message(), HasSubstr("is of 5 vertices"));
  previous.displacement = Eigen::Matrix4Xf::Zero(4, source_.num_vertices());
  previous.displacement(2, 7) = std::numeric_limits<float>::infinity();
  EXPECT_THAT(Refined(previous, {}, {}).status().message(), HasSubstr("not finite"));
}

}  // namespace
}  // namespace liquidblend::registration::refine_test
