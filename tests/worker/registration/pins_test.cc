#include "worker/registration/pins.h"

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
  absl::StatusOr<std::vector<Pin>> Expand(const Correspondence& c) const {
    return ExpandCorrespondences({c}, source_.surface, target_.surface);
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
  EXPECT_EQ(TermOf(pin, 20).metric.diagonal(), Eigen::Vector4f::Constant(20));
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
  ASSERT_EQ(pins->size(), 3u);
  EXPECT_EQ(TermOf(pins->front(), 5).metric(3, 3), 0.0f);
  EXPECT_EQ(TermOf(pins->front(), 5).metric(2, 2), 5.0f);
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
}

}  // namespace
}  // namespace liquidblend::registration
