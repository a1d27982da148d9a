#include "worker/registration/register.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>

#include "core/slice/slice.h"
#include "tests/synthetic/slice_family.h"
#include "tests/worker/registration/registration_testing.h"
#include "worker/registration/surface/surface.h"

namespace liquidblend::registration::register_test {
namespace {

using ::testing::HasSubstr;

// A drop that falls into a pool; the other one starts higher, so it strikes later.
mesh::Animation Drop(double height_m) {
  synthetic::FallingDropOptions options;
  options.drop_m[2] = static_cast<float>(height_m);
  options.spacing_m = 0.1;
  options.num_frames = 10;
  return synthetic::FallingDrop(options);
}

RegistrationOptions SmallOptions() {
  RegistrationOptions options;
  options.sample_share = 0.2;  // the meshes are small
  options.max_iterations = 10;
  return options;
}

RegistrationOptions FewIterations() {
  RegistrationOptions options = SmallOptions();
  options.max_iterations = 6;
  return options;
}

absl::StatusOr<Registration> RegisterDrops(const mesh::SpaceTimeMesh& source,
                                           const mesh::SpaceTimeMesh& target, int num_threads,
                                           const ProgressCallback& progress = {}) {
  return Register(source, target, {}, SmallOptions(), parallel::Arena(num_threads),
                  {.progress = progress});
}

mesh::TriangleMesh Cut(const mesh::SpaceTimeMesh& mesh, const Registration& registration,
                       double weight, double time_s) {
  mesh::RegisteredFamily family = mesh::ViewOf(mesh);
  const auto view = [](const Eigen::Matrix4Xf& columns) {
    return std::span(reinterpret_cast<const mesh::Float4*>(columns.data()),
                     static_cast<size_t>(columns.cols()));
  };
  mesh::FamilyTarget target;
  target.displacement = view(registration.displacement);
  target.extrapolation = view(registration.extrapolation);
  family.targets = {target};
  family.domain_min = {-9, -9, -9};
  family.domain_max = {9, 9, 9};
  const slice::CellIndex index(family);
  return synthetic::SliceFamily(index, std::vector{weight}, time_s);
}

// Height of the drop's centre at frame 0: the vertices above the pool.
double DropHeight(const mesh::TriangleMesh& surface) {
  double sum = 0;
  int count = 0;
  for (int64_t v = 0; v < surface.num_vertices(); ++v) {
    if (surface.vertices(2, v) < 0.1f) continue;
    sum += surface.vertices(2, v);
    ++count;
  }
  return sum / std::max(1, count);
}

class RegisterTest : public ::testing::Test {
 protected:
  mesh::SpaceTimeMesh source_ = BuildMesh(Drop(0.45));
  mesh::SpaceTimeMesh target_ = BuildMesh(Drop(0.75));
};

TEST_F(RegisterTest, WeightOneIsTheTargetAndHalfLiesBetween) {
  const auto result = RegisterDrops(source_, target_, 2);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_LT(result->report.mean_residual_edges, 0.2);
  EXPECT_GT(result->report.inlier_share, 0.9);
  const double source = DropHeight(Cut(source_, *result, 0.0, 0));
  const double half = DropHeight(Cut(source_, *result, 0.5, 0));
  const double target = DropHeight(Cut(source_, *result, 1.0, 0));
  EXPECT_NEAR(source, 0.45, 0.02);
  EXPECT_NEAR(half, 0.60, 0.02);
  EXPECT_NEAR(target, 0.75, 0.02);
}

TEST_F(RegisterTest, EveryBlendIsClosed) {
  const auto result = RegisterDrops(source_, target_, 2);
  ASSERT_TRUE(result.ok()) << result.status();
  for (const double weight : {-0.25, 0.3, 0.5, 1.0, 1.25}) {
    for (int n = 0; n <= 30; ++n) {
      const auto surface = Cut(source_, *result, weight, 9.0 / 24 * n / 30);
      EXPECT_TRUE(mesh::CheckClosed(surface).closed()) << weight << ' ' << n;
      EXPECT_TRUE(surface.vertices.allFinite());
    }
  }
}

TEST_F(RegisterTest, SameBytesAtAnyThreadCount) {
  const auto one = RegisterDrops(source_, target_, 1);
  ASSERT_TRUE(one.ok()) << one.status();
  for (const int num_threads : {2, 8}) {
    const auto many = RegisterDrops(source_, target_, num_threads);
    ASSERT_TRUE(many.ok());
    const size_t bytes = sizeof(float) * static_cast<size_t>(one->displacement.size());
    EXPECT_EQ(std::memcmp(one->displacement.data(), many->displacement.data(), bytes), 0);
    EXPECT_EQ(std::memcmp(one->extrapolation.data(), many->extrapolation.data(), bytes), 0);
  }
}

TEST_F(RegisterTest, ReportsEachIterationAndCanBeCancelled) {
  int calls = 0;
  const auto cancelled = RegisterDrops(source_, target_, 2, [&](const IterationReport& report) {
    EXPECT_EQ(report.iteration, ++calls);
    EXPECT_EQ(report.num_iterations, SmallOptions().max_iterations);
    EXPECT_GT(report.num_inliers, 0);
    EXPECT_LE(report.num_inliers, report.num_samples);
    return calls < 3;
  });
  EXPECT_EQ(cancelled.status().code(), absl::StatusCode::kCancelled);
  EXPECT_EQ(calls, 3);
}

// The top of the source's drop, and not where it would go by itself.
Correspondence OffCentre(bool hard) {
  Correspondence c;
  c.hard = hard;
  c.source = {0, 0, 0.65, 3};
  c.target = {0.25, 0, 0.95, 2};
  return c;
}

TEST_F(RegisterTest, AHardPointHoldsExactlyAndTearsNothing) {
  const Correspondence hard = OffCentre(true);
  const auto pinned = Register(source_, target_, {hard}, FewIterations(), parallel::Arena(2));
  ASSERT_TRUE(pinned.ok()) << pinned.status();
  const double edge = source_.edge_length_m;
  Eigen::Index top = 0;
  (InEdgeUnits(source_.vertices, edge).colwise() -
   Eigen::Vector4f(0, 0, static_cast<float>(0.65 / edge), 3))
      .colwise()
      .squaredNorm()
      .minCoeff(&top);
  const Eigen::Vector4d moved = pinned->displacement.col(top).cast<double>();
  const Eigen::Vector4d miss = moved - (hard.target - hard.source);
  EXPECT_LT(miss.head<3>().norm(), 1e-3 * edge);
  EXPECT_LT(std::abs(miss[3]), 1e-3);
  ASSERT_EQ(pinned->report.correspondences.size(), 1u);
  EXPECT_TRUE(pinned->report.correspondences[0].kept);
  EXPECT_EQ(pinned->report.correspondences[0].num_nodes, 1);
  EXPECT_LT(pinned->report.correspondences[0].residual_m, 1e-3 * edge);

  const Surface surface(source_, edge, parallel::Arena(2));
  const PackedLists neighbors = VertexNeighbors(source_, surface.cells_around, parallel::Arena(2));
  const Points displacement = InEdgeUnits(pinned->displacement, edge);
  for (const int32_t w : neighbors[top]) {
    const float distance = (surface.points.col(w) - surface.points.col(top)).norm();
    // It is pulled off its drop, which is only two edges wide.
    EXPECT_LT((displacement.col(w) - displacement.col(top)).norm(), 1.6f * distance);
  }
}

TEST_F(RegisterTest, ASoftPointIsReleasedAndReportedAsOverruled) {
  Correspondence aside = OffCentre(false);
  aside.target = {0.4, 0, 0.75, 2};
  const auto soft = Register(source_, target_, {aside}, SmallOptions(), parallel::Arena(2));
  ASSERT_TRUE(soft.ok()) << soft.status();
  const CorrespondenceReport& report = soft->report.correspondences.at(0);
  EXPECT_EQ(report.correspondence, aside);
  EXPECT_FALSE(report.kept);
  EXPECT_GT(report.residual_m, source_.edge_length_m);
  EXPECT_LT(soft->report.mean_residual_edges, 0.25);
}

TEST_F(RegisterTest, TwoHardPointsThatContradictEachOtherAreNamed) {
  Correspondence other = OffCentre(true);
  other.target[0] = -0.25;
  const auto refused =
      Register(source_, target_, {OffCentre(true), other}, FewIterations(), parallel::Arena(2));
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(refused.status().message(), HasSubstr("correspondences 0 and 1 are both hard"));
}

TEST_F(RegisterTest, RefusesBadOptionsAndMeshes) {
  RegistrationOptions options;
  options.node_spacing_edges = 0.5;
  EXPECT_THAT(Register(source_, target_, {}, options, parallel::Arena(1)).status().message(),
              HasSubstr("node_spacing_edges is 0.5"));
  mesh::SpaceTimeMesh faster = target_;
  faster.frames_per_second = 48;
  EXPECT_THAT(RegisterDrops(source_, faster, 1).status().message(), HasSubstr("48"));
  mesh::SpaceTimeMesh bare = target_;
  bare.normals.resize(4, 0);
  EXPECT_THAT(RegisterDrops(source_, bare, 1).status().message(), HasSubstr("target"));
}

}  // namespace
}  // namespace liquidblend::registration::register_test
