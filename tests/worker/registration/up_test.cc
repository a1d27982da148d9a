// Registrations of animations whose up is another direction than z.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/synthetic/turned.h"
#include "tests/worker/registration/drops_testing.h"
#include "worker/registration/features/automatic.h"
#include "worker/registration/features/part_motions.h"
#include "worker/registration/register.h"

namespace liquidblend::registration {
namespace {

using mesh::Up;
using synthetic::Turned;

const parallel::Arena kArena(2);

class UpTest : public ::testing::TestWithParam<Up> {
 protected:
  mesh::SpaceTimeMesh TurnedMesh(const mesh::SpaceTimeMesh& mesh) const {
    return Turned(mesh, GetParam());
  }

  const mesh::SpaceTimeMesh source_ = Scene({DropAt(-0.2, 0.8)}, 0.6);
  const mesh::SpaceTimeMesh target_ = Scene({DropAt(0.1, 0.6)}, 0.6);
};

// The time scale depends on how low the drop comes.
TEST_P(UpTest, PartMotionsOfFallingPartsAreTheSameOnesTurned) {
  const auto motions_of = [](const mesh::SpaceTimeMesh& from, const mesh::SpaceTimeMesh& to) {
    const TestSurface source(from);
    const Surface target(to, from.edge_length_m, kArena);
    return PartMotions(FindTrackFeatures(source.surface), FindTrackFeatures(target),
                       {.tracks = {{0, 0, 1.0}}, .extrema = {}}, {}, from.edge_length_m,
                       TimesBlend::kLinearly)
        .all();
  };
  const std::vector<PartMotion> expected = motions_of(source_, target_);
  const std::vector<PartMotion> found = motions_of(TurnedMesh(source_), TurnedMesh(target_));
  ASSERT_EQ(expected.size(), 1u);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NEAR(found[0].time_scale, expected[0].time_scale, 1e-9);
  EXPECT_NEAR(found[0].time_offset, expected[0].time_offset, 1e-9);
  mesh::SpaceTimeMesh wrong_source = TurnedMesh(source_), wrong_target = TurnedMesh(target_);
  wrong_source.up = wrong_target.up = Up::kUnknown;
  const std::vector<PartMotion> wrong = motions_of(wrong_source, wrong_target);
  ASSERT_EQ(wrong.size(), 1u);
  EXPECT_GT(std::abs(wrong[0].time_scale - expected[0].time_scale), 1e-4) << "with z as up";
}

TEST_P(UpTest, ARegistrationIsTheSameTurnedToRounding) {
  RegistrationOptions options;
  options.max_iterations = 6;
  const auto expected = Register(source_, target_, {}, options, kArena);
  const auto found = Register(TurnedMesh(source_), TurnedMesh(target_), {}, options, kArena);
  ASSERT_TRUE(expected.ok()) << expected.status();
  ASSERT_TRUE(found.ok()) << found.status();
  Eigen::Matrix4Xf turned = expected->displacement;
  turned.topRows<3>() = (synthetic::TurnTo(GetParam()) * turned.topRows<3>()).eval();
  Eigen::Matrix4Xf difference = found->displacement - turned;
  difference.topRows<3>() /= static_cast<float>(source_.edge_length_m);
  const Eigen::VectorXf lengths = difference.colwise().norm();
  EXPECT_LT(lengths.mean(), 1e-3f);
  EXPECT_EQ(found->report.correspondences.size(), expected->report.correspondences.size());
  EXPECT_EQ(found->report.verdict.grade, expected->report.verdict.grade);
}

INSTANTIATE_TEST_SUITE_P(All, UpTest, ::testing::Values(Up::kY, Up::kMinusX, Up::kMinusZ),
                         [](const auto& param) {
                           std::string name = mesh::NameOf(param.param);
                           return name[0] == '-' ? "Minus" + name.substr(1) : name;
                         });

}  // namespace
}  // namespace liquidblend::registration
