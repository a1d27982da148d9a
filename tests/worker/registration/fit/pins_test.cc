#include "worker/registration/fit/pins.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/worker/registration/registration_testing.h"

namespace liquidblend::registration {
namespace {

using ::testing::HasSubstr;

class PinsTest : public ::testing::Test {
 protected:
  static mesh::SpaceTimeMesh Sphere(const Eigen::Vector3f& offset_m) {
    synthetic::MovingSphereOptions options;
    options.centre_m = offset_m;
    options.num_frames = 26;
    return BuildMesh(synthetic::MovingSphere(options));
  }
  PinsTest() : source_(Sphere({0, 0, 0})), target_(Sphere({0, 0, 1})) {}

  // The top of each sphere at frame 2.
  static Correspondence Tops(CorrespondenceKind kind) {
    Correspondence c;
    c.kind = kind;
    c.source = {2.0 / 24, 0, 0.5, 2};
    c.target = {2.0 / 24, 0, 1.5, 2};
    return c;
  }
  absl::StatusOr<std::vector<Pin>> Expand(const Correspondence& c,
                                          float on_surface = kOnSurfaceEdges) const {
    return ExpandCorrespondences({c}, source_.surface, target_.surface, parallel::Arena(2),
                                 on_surface);
  }
  float edge() const { return static_cast<float>(source_.mesh.edge_length_m); }

  TestSurface source_, target_;
};

TEST_F(PinsTest, APointIsOnePinWithItsDisplacement) {
  const auto pins = Expand(Tops(CorrespondenceKind::kPoint));
  ASSERT_TRUE(pins.ok()) << pins.status();
  ASSERT_EQ(pins->size(), 1u);
  const Pin& pin = pins->front();
  EXPECT_NEAR((pin.goal - Eigen::Vector4f(0, 0, 1 / edge(), 0)).norm(), 0, 1e-3f);
  const Eigen::Vector4f at = source_.surface.points.col(pin.vertex);
  EXPECT_NEAR((at - Eigen::Vector4f(2.0f / 24 / edge(), 0, 0.5f / edge(), 2)).norm(), 0, 1.0f);
}

TEST_F(PinsTest, ATrajectoryFollowsTheLiquidEveryTenFrames) {
  const auto pins = Expand(Tops(CorrespondenceKind::kTrajectory));
  ASSERT_TRUE(pins.ok()) << pins.status();
  ASSERT_EQ(pins->size(), 3u);  // frames 2, 12, 22 of 0 to 25
  for (size_t n = 0; n < 3; ++n) {
    const Eigen::Vector4f at = source_.surface.points.col((*pins)[n].vertex);
    const float frame = 2.0f + 10.0f * static_cast<float>(n);
    EXPECT_NEAR(at[3], frame, 1.0f);
    EXPECT_NEAR(at[0] * edge(), frame / 24, 1.2f * edge());  // 1 m/s along x
    EXPECT_NEAR((*pins)[n].goal[2] * edge(), 1.0f, 1e-3f);
  }
}

TEST_F(PinsTest, ASpacePinIsFreeInTime) {
  const auto pins = Expand(Tops(CorrespondenceKind::kSpace));
  ASSERT_TRUE(pins.ok()) << pins.status();
  ASSERT_EQ(pins->size(), 2u);  // by frame 22 the sphere has left the place
  for (const Pin& pin : *pins) EXPECT_FALSE(pin.in_time);
}

TEST_F(PinsTest, ATrajectoryEndsWithItsLength) {
  Correspondence c = Tops(CorrespondenceKind::kTrajectory);
  c.length_frames = 12;
  const auto pins = Expand(c);
  ASSERT_TRUE(pins.ok()) << pins.status();
  EXPECT_EQ(pins->size(), 2u);  // frames 2 and 12
}

TEST_F(PinsTest, AMoveInTimeIsNotAskedOfAnEndSlab) {
  Correspondence c = Tops(CorrespondenceKind::kPoint);
  c.source = {0, 0, 0.5, 0};
  c.target = {2.0 / 24, 0, 1.5, 2};
  const auto pins = Expand(c);
  ASSERT_TRUE(pins.ok()) << pins.status();
  EXPECT_FALSE(source_.surface.InFirstSlab(pins->front().vertex));
}

TEST_F(PinsTest, ASoftPinTakesThePlaceOfClosestPoints) {
  const auto pins = Expand(Tops(CorrespondenceKind::kSpace));
  ASSERT_TRUE(pins.ok()) << pins.status();
  const int32_t v = pins->front().vertex;
  const FitTerm match = {0, Eigen::Vector4f::Ones(), Eigen::Matrix4f::Identity()};
  std::vector<FitTerm> terms(8, match);
  for (FitTerm& term : terms) term.vertex = v == 0 ? 1 : 0;
  terms[5].vertex = v;
  OverrideClosestPoints(*pins, 20, 2, terms);
  ASSERT_EQ(terms.size(), 7 + pins->size());
  for (size_t n = 0; n < 7; ++n) EXPECT_NE(terms[n].vertex, v);
  EXPECT_EQ(terms[7].vertex, v);
  EXPECT_EQ(terms[7].goal, pins->front().goal);
  // 7 terms, 2 nodes.
  EXPECT_EQ(terms[7].metric.diagonal(), Eigen::Vector4f(70, 70, 70, 0));
}

TEST_F(PinsTest, TheReportSaysWhichAreOverruledAndByHowMuch) {
  Correspondence soft = Tops(CorrespondenceKind::kPoint), hard = soft;
  hard.hard = true;
  Correspondence space = Tops(CorrespondenceKind::kSpace);
  const std::vector<Correspondence> all = {soft, hard, space};
  const auto pins =
      ExpandCorrespondences(all, source_.surface, target_.surface, parallel::Arena(2));
  ASSERT_TRUE(pins.ok()) << pins.status();
  Points displacement = Points::Zero(4, source_.surface.points.cols());
  for (const Pin& pin : *pins) displacement.col(pin.vertex) = pin.goal;
  auto reports = ReportCorrespondences(all, *pins, displacement, edge());
  ASSERT_EQ(reports.size(), 3u);
  EXPECT_EQ(reports[0].correspondence, soft);
  EXPECT_EQ(reports[2].num_nodes, 2);
  for (const auto& report : reports) {
    EXPECT_TRUE(report.kept);
    EXPECT_EQ(report.residual_m, 0);
    EXPECT_EQ(report.residual_frames, 0);
  }
  displacement.row(3).array() += 2.5f;
  displacement.row(1).array() += 2.0f;
  reports = ReportCorrespondences(all, *pins, displacement, edge());
  EXPECT_FALSE(reports[0].kept);  // (2, 2.5) is longer than 3
  EXPECT_TRUE(reports[1].kept);   // hard
  EXPECT_TRUE(reports[2].kept);   // time does not count
  EXPECT_NEAR(reports[0].residual_m, 2 * edge(), 1e-5);
  EXPECT_NEAR(reports[0].residual_frames, 2.5, 1e-5);
  EXPECT_EQ(reports[2].residual_frames, 0);
}

TEST_F(PinsTest, RefusesWithTheNumberOfTheCorrespondence) {
  Correspondence late = Tops(CorrespondenceKind::kPoint);
  late.target[3] = 26;
  EXPECT_THAT(Expand(late).status().message(), HasSubstr("correspondence 0, target"));
  Correspondence broken = Tops(CorrespondenceKind::kPoint);
  broken.source[1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(Expand(broken).status().message(), HasSubstr("source: a number is not finite"));
  Correspondence negative = Tops(CorrespondenceKind::kSpace);
  negative.length_frames = -1;
  EXPECT_THAT(Expand(negative).status().message(), HasSubstr("length is -1"));
  Correspondence astray = Tops(CorrespondenceKind::kPoint);
  astray.source[2] = 3;
  EXPECT_THAT(Expand(astray).status().message(), HasSubstr("source: it lies"));
  EXPECT_THAT(Expand(astray).status().message(), HasSubstr("off the surface"));
  EXPECT_TRUE(Expand(astray, /*on_surface=*/1e3f).ok());
}

}  // namespace
}  // namespace liquidblend::registration
