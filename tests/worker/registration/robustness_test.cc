// Whatever comes in, registration gives a graded result or an error that says what is wrong.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <type_traits>
#include <utility>
#include <vector>

#include "tests/synthetic/implicit.h"
#include "tests/synthetic/shapes.h"
#include "tests/worker/registration/clips.h"
#include "worker/registration/register.h"
#include "worker/registration/surface/blend_figures.h"
#include "worker/spacetime/build.h"

namespace liquidblend::registration::robustness_test {
namespace {

using ::testing::HasSubstr;

constexpr int kPairsPerBatch = 20;

RegistrationOptions FewIterations() {
  RegistrationOptions options;
  options.max_iterations = 4;
  options.sample_share = 0.2;
  return options;
}

// Blends of any weight are closed and of finite numbers.
void ExpectBlends(const mesh::SpaceTimeMesh& mesh, const Eigen::Matrix4Xf& displacement_m,
                  const parallel::Arena& arena) {
  const Surface source(mesh, mesh.edge_length_m, parallel::Arena(2));
  const Points displacement = InEdgeUnits(displacement_m, mesh.edge_length_m);
  for (const float weight : {-0.5f, 0.5f, 1.0f}) {
    const std::vector<mesh::TriangleMesh> slices = SliceBlend(source, displacement, weight, arena);
    ASSERT_FALSE(slices.empty()) << weight;
    for (const mesh::TriangleMesh& slice : slices) {
      EXPECT_TRUE(slice.vertices.allFinite()) << weight;
      EXPECT_TRUE(mesh::CheckClosed(slice).closed()) << weight;
    }
  }
}

void ExpectGraded(const mesh::Verdict& verdict) {
  EXPECT_NE(verdict.grade, mesh::Grade::kUnknown);
  EXPECT_FALSE(verdict.reason.empty());
  for (const double x : verdict.worst) EXPECT_TRUE(std::isfinite(x)) << verdict.reason;
  mesh::Verdict::ForEachFigure(verdict, [&](const char* name, const auto& figure) {
    if constexpr (std::is_same_v<decltype(figure), const double&>) {
      EXPECT_TRUE(std::isfinite(figure)) << name << ": " << verdict.reason;
    } else {
      EXPECT_FALSE(figure.empty()) << name;
      for (const double x : figure) EXPECT_TRUE(std::isfinite(x)) << name << ": " << verdict.reason;
    }
  });
}

// Registers and checks the result; the error if there is none.
absl::StatusOr<mesh::Verdict> RegisterPair(const mesh::Animation& a, const mesh::Animation& b,
                                           const spacetime::BuildOptions& options = {}) {
  const parallel::Arena arena(2);
  const auto source = spacetime::Build(a, options, arena),
             target = spacetime::Build(b, options, arena);
  for (const auto* mesh : {&source, &target}) {
    if (!mesh->ok()) return mesh->status();
  }
  const auto result = Register(*source, *target, {}, FewIterations(), arena);
  if (!result.ok()) return result.status();
  EXPECT_TRUE(result->displacement.allFinite());
  EXPECT_TRUE(result->extrapolation.allFinite());
  EXPECT_TRUE(std::isfinite(result->report.mean_residual_edges));
  ExpectGraded(result->report.verdict);
  ExpectBlends(*source, result->displacement, arena);
  return result->report.verdict;
}

class RandomPairs : public ::testing::TestWithParam<int> {};

TEST_P(RandomPairs, AreGradedOrRefusedByName) {
  int num_graded = 0, num_good = 0;
  for (int n = 0; n < kPairsPerBatch; ++n) {
    const uint64_t seed = static_cast<uint64_t>(GetParam() * kPairsPerBatch + n);
    SCOPED_TRACE(seed);
    spacetime::BuildOptions options;
    if (n % 2 == 0) options.droplet_vertices = 0;  // all but the largest clips are droplets
    const mesh::Animation source = RandomClip(2 * seed);
    const mesh::Animation target = n % 4 < 2 ? Scaled(source, 1.02) : RandomClip(2 * seed + 1);
    const auto verdict = RegisterPair(source, target, options);
    if (verdict.ok()) {
      ++num_graded;
      num_good += verdict->grade == mesh::Grade::kGood ? 1 : 0;
      continue;
    }
    EXPECT_EQ(verdict.status().code(), absl::StatusCode::kInvalidArgument) << verdict.status();
    EXPECT_GT(verdict.status().message().size(), 20U) << verdict.status();
  }
  EXPECT_GE(num_graded, kPairsPerBatch / 2);  // most are not degenerate ...
  EXPECT_GE(num_good, 3);                     // ... and half of the pairs are almost alike
  std::printf("%d of %d graded, %d of them good\n", num_graded, kPairsPerBatch, num_good);
}

INSTANTIATE_TEST_SUITE_P(OneHundred, RandomPairs, ::testing::Range(0, 5));

mesh::Animation Pool() { return Still(synthetic::Box({-1, -1, -0.3f}, {1, 1, 0}, 16), 4); }

mesh::Animation Drop(double height_m) {
  synthetic::FallingDropOptions options;
  options.drop_m.z() = static_cast<float>(height_m);
  options.drop_radius_m = 0.35;
  options.spacing_m = 0.12;
  options.num_frames = 4;
  return synthetic::FallingDrop(options);
}

TEST(Degenerate, AStillPoolAndItself) {
  const auto verdict = RegisterPair(Pool(), Pool());
  ASSERT_TRUE(verdict.ok()) << verdict.status();
  EXPECT_EQ(verdict->grade, mesh::Grade::kGood) << verdict->reason;
}

TEST(Degenerate, ATetrahedron) {
  mesh::TriangleMesh tetrahedron;
  tetrahedron.vertices.resize(3, 4);
  tetrahedron.vertices << 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1;
  tetrahedron.triangles.resize(3, 4);
  tetrahedron.triangles << 0, 0, 0, 1, 2, 1, 3, 2, 1, 3, 2, 3;
  ASSERT_TRUE(mesh::CheckClosed(tetrahedron).closed());
  const mesh::Animation animation = Still(tetrahedron, 2);
  const auto verdict = RegisterPair(animation, animation);
  EXPECT_TRUE(verdict.ok()) << verdict.status();
  const auto with_pool = RegisterPair(animation, Pool());
  EXPECT_TRUE(with_pool.ok()) << with_pool.status();
}

TEST(Degenerate, OneFrameIsRefused) {
  mesh::Animation one = Still(synthetic::Icosphere({0, 0, 0}, 1, 2), 1);
  one.name = "lonely";
  const auto verdict = RegisterPair(one, Pool());
  EXPECT_EQ(verdict.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(verdict.status().message()), HasSubstr("'lonely' has 1 frames"));
}

TEST(Degenerate, NothingButEmptyFramesIsRefused) {
  mesh::Animation empty = Still({}, 4);
  empty.name = "void";
  EXPECT_THAT(std::string(RegisterPair(Pool(), empty).status().message()), HasSubstr("'void'"));
}

TEST(Degenerate, LiquidThatComesLateAndGoesEarly) {
  mesh::Animation late = Drop(0.6), early = Drop(0.6);
  late.frames[0] = late.frames[1] = {};
  early.frames[2] = early.frames[3] = {};
  for (const auto& [a, b] : {std::pair(late, early), {early, Drop(0.6)}, {Drop(0.6), late}}) {
    const auto verdict = RegisterPair(a, b);
    ASSERT_TRUE(verdict.ok()) << verdict.status();
    EXPECT_NE(verdict->grade, mesh::Grade::kGood) << verdict->reason;
  }
}

TEST(Degenerate, PairsFarApart) {
  mesh::Animation far = Drop(0.6);
  for (mesh::TriangleMesh& frame : far.frames) frame.vertices.array() += 1e4f;
  const auto verdict = RegisterPair(Drop(0.6), far);
  ASSERT_TRUE(verdict.ok()) << verdict.status();
  EXPECT_EQ(verdict->grade, mesh::Grade::kTooDifferent) << verdict->reason;
}

TEST(Degenerate, TheUnitOfLengthMakesNoDifference) {
  const auto metres = RegisterPair(Drop(0.6), Drop(0.7));
  ASSERT_TRUE(metres.ok()) << metres.status();
  for (const double scale : {1e-3, 1e4}) {
    const auto scaled = RegisterPair(Scaled(Drop(0.6), scale), Scaled(Drop(0.7), scale));
    ASSERT_TRUE(scaled.ok()) << scaled.status();
    EXPECT_EQ(scaled->grade, metres->grade) << scaled->reason;
    // Rounding alone; it decides ties between closest points.
    EXPECT_NEAR(scaled->compatible_share, metres->compatible_share, 0.02);
    EXPECT_NEAR(scaled->stretch, metres->stretch, 0.02);
  }
}

}  // namespace
}  // namespace liquidblend::registration::robustness_test
