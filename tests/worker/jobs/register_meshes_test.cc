#include "worker/jobs/register_meshes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <limits>

#include "core/mesh/slice_at.h"
#include "tests/synthetic/implicit.h"
#include "tests/synthetic/surface_distance.h"

namespace liquidblend::jobs::register_meshes_test {
namespace {

using ::testing::HasSubstr;

// A drop that falls into a pool from a height.
mesh::Animation Drop(float height_m, double radius_m = 0.2) {
  synthetic::FallingDropOptions options;
  options.drop_radius_m = radius_m;
  options.drop_m[2] = height_m;
  options.spacing_m = 0.1;
  options.num_frames = 6;
  return synthetic::FallingDrop(options);
}

RegisterMeshesOptions Options(double coarse_vertices) {
  RegisterMeshesOptions options;
  options.build.connectivity = spacetime::Connectivity::kRebuilt;
  options.build.droplet_vertices = 0;
  options.registration.max_iterations = 6;
  options.registration.refine_iterations = 3;
  options.registration.sample_share = 0.2;
  options.registration.automatic_correspondences = false;
  options.registration.coarse_vertices = coarse_vertices;
  return options;
}

class RegisterMeshesTest : public ::testing::Test {
 protected:
  absl::StatusOr<registration::Registration> Register(
      const RegisterMeshesOptions& options, int num_threads = 2,
      const std::vector<registration::Correspondence>& correspondences = {},
      const registration::PreviousRegistration* previous = nullptr) {
    const auto read = [this](const mesh::Animation& animation) {
      return [this, &animation] {
        ++num_reads_;
        return animation;
      };
    };
    return RegisterMeshes({source_, read(low_)}, {target_, read(high_)}, correspondences, previous,
                          options, parallel::Arena(num_threads));
  }
  static mesh::SpaceTimeMesh Build(const mesh::Animation& animation) {
    return *spacetime::Build(animation, Options(1e6).build, parallel::Arena(2));
  }
  // Of weight 1 from the target's frames, in mean edges.
  double Distance(const registration::Registration& result) const {
    const std::vector<double> times = {0, 2, 4};
    const auto slices =
        mesh::SliceAt(source_, source_.vertices + result.displacement, times, parallel::Arena(2));
    double sum = 0;
    for (size_t n = 0; n < times.size(); ++n) {
      const auto& frame = high_.frames[static_cast<size_t>(times[n])];
      sum += synthetic::MeanSymmetricDistance(slices[n], frame) / source_.edge_length_m;
    }
    return sum / static_cast<double>(times.size());
  }

  const mesh::Animation low_ = Drop(0.45f), high_ = Drop(0.65f);
  const mesh::SpaceTimeMesh source_ = Build(low_), target_ = Build(high_);
  std::atomic<int> num_reads_ = 0;  // of both meshes at the same time
};

TEST_F(RegisterMeshesTest, SmallMeshesAreRegisteredAtOnce) {
  const auto result = Register(Options(1e6));
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(num_reads_, 0);
  EXPECT_LT(Distance(*result), 0.1);
}

TEST_F(RegisterMeshesTest, LargeOnesBeginCoarseAndComeAsClose) {
  ASSERT_GT(source_.num_vertices(), 3 * 1000) << "large enough to begin coarse";
  const auto at_once = Register(Options(1e6));
  const auto result = Register(Options(1000));
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(num_reads_, 2);
  EXPECT_LT(2 * result->report.num_nodes, at_once->report.num_nodes);
  EXPECT_EQ(result->report.num_iterations, 6);
  EXPECT_LT(Distance(*result), 0.1);
}

TEST(RegisterMeshes, ADropOfFewCoarseEdgesIsStillFound) {
  const mesh::Animation low = Drop(0.6f, 0.3), high = Drop(0.8f, 0.3);
  RegisterMeshesOptions options = Options(1500);
  options.registration.automatic_correspondences = true;
  const parallel::Arena arena(2);
  const auto source = spacetime::Build(low, options.build, arena);
  const auto target = spacetime::Build(high, options.build, arena);
  ASSERT_TRUE(source.ok() && target.ok());
  const double scale = registration::CoarseScale(source->num_vertices(), options.registration);
  const double diameter = 0.6 / (scale * source->edge_length_m);
  ASSERT_LT(diameter, options.registration.smallest_part_edges) << "too few edges for a fine mesh";
  ASSERT_GT(diameter, 2.0);
  const auto result = RegisterMeshes({*source, [&] { return low; }},
                                     {*target, [&] { return high; }}, {}, nullptr, options, arena);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(result->report.correspondences.size(), 6u) << "the sides of the drop";
}

// A drop that falls elsewhere, registered coarse to fine. Without pairs it grabs the pool.
class DropElsewhereTest : public ::testing::Test {
 protected:
  static mesh::Animation DropAt(double x) {
    synthetic::FallingDropsOptions options;
    options.drops = {{{x, 0, 0.7}, 0.25, 0}};
    options.pool_half_width_m = {1.2, 0.5};
    options.num_frames = 12;
    options.spacing_m = 0.06;
    return synthetic::FallingDrops(options);
  }
  static mesh::SpaceTimeMesh Build(const mesh::Animation& animation) {
    return *spacetime::Build(animation, Options(0).build, parallel::Arena(2));
  }
  registration::Registration Register(
      registration::Pairing pairing, const registration::PreviousRegistration* previous = nullptr) {
    RegisterMeshesOptions options = Options(0.35 * static_cast<double>(source_.num_vertices()));
    options.registration.automatic_correspondences = true;
    options.registration.pairing = pairing;
    options.registration.max_iterations = 8;
    const auto read = [&](const mesh::Animation& animation) {
      return [&] {
        ++num_reads_;
        return animation;
      };
    };
    auto result = RegisterMeshes({source_, read(left_)}, {target_, read(right_)}, {}, previous,
                                 options, parallel::Arena(2));
    EXPECT_TRUE(result.ok()) << result.status();
    return *std::move(result);
  }

  const mesh::Animation left_ = DropAt(-0.6), right_ = DropAt(0.6);
  const mesh::SpaceTimeMesh source_ = Build(left_), target_ = Build(right_);
  std::atomic<int> num_reads_ = 0;
};

TEST_F(DropElsewhereTest, PairingsAreTriedOnCoarseMeshesAndFinerNodesFollowTheOneKept) {
  const registration::Registration result = Register(registration::Pairing::kNone);
  EXPECT_EQ(num_reads_, 2) << "the coarse meshes are made once";
  ASSERT_EQ(result.report.hypotheses.size(), 2u);
  EXPECT_TRUE(result.report.hypotheses[1].is_kept);
  EXPECT_EQ(result.displacement, Register(registration::Pairing::kFound).displacement);
}

TEST_F(DropElsewhereTest, ARefinementKeepsThePairing) {
  const Eigen::Matrix4Xf displacement = Register(registration::Pairing::kFound).displacement;
  const std::vector<registration::Correspondence> none;
  const registration::PreviousRegistration with_pairs{displacement, none};
  EXPECT_FALSE(Register(registration::Pairing::kFound, &with_pairs).report.correspondences.empty());
  const registration::PreviousRegistration without_pairs{
      displacement, none, {{"no pairs of features", 1.5, true}}};
  const mesh::RegistrationReport refined =
      Register(registration::Pairing::kFound, &without_pairs).report;
  EXPECT_TRUE(refined.correspondences.empty());
  ASSERT_EQ(refined.hypotheses.size(), 1u);
  EXPECT_EQ(refined.hypotheses[0].cost, 1.5);
}

TEST(CoarseOptions, FindSmallerPartsAndHoldThemForLonger) {
  registration::RegistrationOptions options;
  EXPECT_DOUBLE_EQ(registration::CoarseOptions(1.6, options).smallest_part_edges, 2.5);
  const auto coarse = registration::CoarseOptions(8.0, options);
  EXPECT_DOUBLE_EQ(coarse.smallest_part_edges, 2.0) << "less is noise";
  EXPECT_GT(coarse.soft_release, options.soft_release);
  options.smallest_part_edges = 1.0;
  options.soft_release = 1.0;
  EXPECT_DOUBLE_EQ(registration::CoarseOptions(8.0, options).smallest_part_edges, 1.0);
  EXPECT_DOUBLE_EQ(registration::CoarseOptions(8.0, options).soft_release, 1.0);
}

TEST_F(RegisterMeshesTest, CoarseToFineGivesTheSameBytesForAnyNumberOfThreads) {
  const auto one = Register(Options(1000), 1), eight = Register(Options(1000), 8);
  ASSERT_TRUE(one.ok() && eight.ok());
  EXPECT_EQ(one->displacement, eight->displacement);
  EXPECT_EQ(one->extrapolation, eight->extrapolation);
}

TEST_F(RegisterMeshesTest, HardCorrespondencesHoldOnTheFineMesh) {
  registration::Correspondence top;
  top.hard = true;
  Eigen::Index source = 0, target = 0;
  source_.vertices.row(2).maxCoeff(&source);
  target_.vertices.row(2).maxCoeff(&target);
  const auto event = [](const Eigen::Vector4f& vertex) {
    Eigen::Vector4d place = vertex.cast<double>();
    place[3] = std::max(0.0, place[3]);  // in frames; an end slab's vertex lies before the first
    return place;
  };
  top.source = event(source_.vertices.col(source));
  top.target = event(target_.vertices.col(target));
  const auto result = Register(Options(1000), 2, {top});
  ASSERT_TRUE(result.ok()) << result.status();
  ASSERT_EQ(result->report.correspondences.size(), 1u);
  EXPECT_LT(result->report.correspondences[0].residual_m, 1e-4);
  EXPECT_TRUE(result->report.correspondences[0].kept);
}

TEST_F(RegisterMeshesTest, RefinesCoarseToFine) {
  const auto first = Register(Options(1000));
  ASSERT_TRUE(first.ok()) << first.status();
  const std::vector<registration::Correspondence> none;
  const registration::PreviousRegistration previous{first->displacement, none};
  const auto refined = Register(Options(1000), 2, {}, &previous);
  ASSERT_TRUE(refined.ok()) << refined.status();
  EXPECT_LT(refined->report.num_iterations, first->report.num_iterations);
  EXPECT_LT(Distance(*refined), 0.1);
}

TEST_F(RegisterMeshesTest, NamesACoarseRegistrationOfOtherMeshes) {
  registration::Registration other;
  other.displacement = Eigen::Matrix4Xf::Zero(4, 7);
  const parallel::Arena arena(2);
  const auto message = [&] {
    return std::string(registration::Sharpen(source_, target_, {}, {source_, other}, {}, arena)
                           .status()
                           .message());
  };
  EXPECT_THAT(message(), HasSubstr("of 7 vertices"));
  other.displacement = Eigen::Matrix4Xf::Zero(4, source_.num_vertices());
  other.displacement(2, 5) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(message(), HasSubstr("not finite"));
}

TEST_F(RegisterMeshesTest, AnAnimationThatCannotBeReadIsTheError) {
  const auto fails = []() -> absl::StatusOr<mesh::Animation> {
    return absl::DataLossError("animation 'low' is gone");
  };
  const auto result = RegisterMeshes({source_, fails}, {target_, fails}, {}, nullptr, Options(1000),
                                     parallel::Arena(2));
  EXPECT_EQ(result.status(), absl::DataLossError("animation 'low' is gone"));
}

}  // namespace
}  // namespace liquidblend::jobs::register_meshes_test
