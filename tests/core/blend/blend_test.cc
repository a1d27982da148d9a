#include "core/blend/blend.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <limits>
#include <numeric>
#include <string>
#include <vector>

#include "tests/synthetic/families.h"

namespace liquidblend::blend {
namespace {

using mesh::Float4;
using mesh::RegisteredFamily;
using testing::AllOf;
using testing::HasSubstr;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kTolerance = 1e-5F;  // float rounding of numbers up to 16

RegisteredFamily TwoTargets() {
  return synthetic::MakeFamily(
      synthetic::HexahedralSphere(4),
      {{synthetic::Noise(1, 0.05F, 0.5F), synthetic::Noise(2, 0.05F, 0.5F)},
       {synthetic::Noise(3, 0.05F, 0.5F), {}}});
}

using VertexRange = std::array<int32_t, 2>;  // vertices [begin, end)

VertexRange All(const RegisteredFamily& family) {
  return {0, static_cast<int32_t>(family.vertices.size())};
}

// The vertices between the end slabs.
VertexRange Inner(const RegisteredFamily& family) {
  return {static_cast<int32_t>(family.num_first_vertices),
          static_cast<int32_t>(static_cast<int64_t>(family.vertices.size()) -
                               family.num_last_vertices)};
}

std::vector<Float4> Blend(const RegisteredFamily& family, const std::vector<double>& weights,
                          VertexRange range) {
  std::vector<int32_t> vertices(range[1] - range[0]);
  std::iota(vertices.begin(), vertices.end(), range[0]);
  std::vector<Float4> positions(vertices.size());
  Blender(family, weights).Place(vertices, positions.data());
  return positions;
}

TEST(CheckWeights, AcceptsOnePerTargetWithinTheBounds) {
  const RegisteredFamily family = TwoTargets();
  EXPECT_TRUE(CheckWeights(family, std::vector{-1.0, 2.0}).ok());
  EXPECT_TRUE(CheckWeights(family, std::vector{0.0, -0.0}).ok());
  EXPECT_TRUE(CheckWeights(synthetic::MakeFamily(synthetic::HexahedralSphere(2), {}), {}).ok());
}

TEST(CheckWeights, NamesTheCount) {
  const RegisteredFamily family = TwoTargets();
  for (const std::vector<double>& weights :
       {std::vector<double>{}, std::vector<double>{0.5}, std::vector<double>{0.5, 0.5, 0.5}}) {
    const absl::Status status = CheckWeights(family, weights);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(status.message()),
                AllOf(HasSubstr("2 targets"), HasSubstr(std::to_string(weights.size()))));
  }
}

TEST(CheckWeights, NamesIndexTargetAndValue) {
  const RegisteredFamily family = TwoTargets();
  for (const double bad : {-1.001, 2.001, 1e300, double{kNan}, double{kInfinity}}) {
    const absl::Status status = CheckWeights(family, std::vector{0.5, bad});
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << bad;
    EXPECT_THAT(std::string(status.message()),
                AllOf(HasSubstr("weights[1]"), HasSubstr("target-2"), HasSubstr("[-1, 2]")));
  }
  EXPECT_THAT(std::string(CheckWeights(family, std::vector{2.5, 0.0}).message()),
              AllOf(HasSubstr("weights[0]"), HasSubstr("2.5")));
}

TEST(Blender, AtWeightZeroIsTheSourceBitForBit) {
  RegisteredFamily family = TwoTargets();
  family.domain_max[0] = 0.25F;  // much of the source lies outside of its domain
  const std::vector<Float4> positions = Blend(family, {0.0, -0.0}, All(family));
  EXPECT_EQ(std::memcmp(positions.data(), family.vertices.data(), family.vertices.size_bytes()), 0);
}

TEST(Blender, FollowsThePiecewiseLinearRule) {
  const RegisteredFamily family = TwoTargets();
  const auto& d = family.targets[0].displacement;
  const auto& e = family.targets[0].extrapolation;
  const VertexRange inner = Inner(family);
  for (const double w : {-1.0, -0.25, 0.3, 1.0, 1.25, 2.0}) {
    const std::vector<Float4> positions = Blend(family, {w, 0.0}, inner);
    for (int32_t v = inner[0]; v < inner[1]; ++v) {
      for (int k = 0; k < 4; ++k) {
        const double moved = w < 0   ? w * e[v][k]
                             : w > 1 ? d[v][k] + (w - 1) * e[v][k]
                                     : w * d[v][k];
        ASSERT_NEAR(positions[v - inner[0]][k], family.vertices[v][k] + moved, kTolerance)
            << "weight " << w << ", vertex " << v << ", component " << k;
      }
    }
  }
}

TEST(Blender, WithoutAnExtrapolationTheDisplacementGoesOn) {
  const RegisteredFamily family = TwoTargets();
  const VertexRange inner = Inner(family);
  for (const double w : {-1.0, 2.0}) {
    const std::vector<Float4> positions = Blend(family, {0.0, w}, inner);
    for (int32_t v = inner[0]; v < inner[1]; ++v) {
      const double moved = w * family.targets[1].displacement[v][3];
      ASSERT_NEAR(positions[v - inner[0]][3], family.vertices[v][3] + moved, kTolerance);
    }
  }
}

TEST(Blender, AddsTheTargetsMotions) {
  const RegisteredFamily family = TwoTargets();
  const VertexRange inner = Inner(family);
  const std::vector<Float4> first = Blend(family, {0.75, 0.0}, inner);
  const std::vector<Float4> second = Blend(family, {0.0, -0.5}, inner);
  const std::vector<Float4> both = Blend(family, {0.75, -0.5}, inner);
  for (size_t i = 0; i < both.size(); ++i) {
    for (int k = 0; k < 4; ++k) {
      const float source = family.vertices[inner[0] + i][k];
      ASSERT_NEAR(both[i][k], first[i][k] + second[i][k] - source, kTolerance);
    }
  }
}

TEST(Blender, PlacesAVertexAlikeInAnyList) {
  const RegisteredFamily family = TwoTargets();
  const std::vector<Float4> all = Blend(family, {0.5, 1.5}, All(family));
  const Blender blender(family, std::vector{0.5, 1.5});
  const std::vector<int32_t> vertices = {513, 3, 899, 3, 0};
  std::vector<Float4> positions(vertices.size() + 1, Float4{9, 9, 9, 9});
  blender.Place(vertices, positions.data());
  for (size_t i = 0; i < vertices.size(); ++i) EXPECT_EQ(positions[i], all[vertices[i]]);
  EXPECT_EQ(positions.back(), (Float4{9, 9, 9, 9}));  // the rest is left alone
}

TEST(Blender, StaysInTheDomainUnlessTheSourceLeavesIt) {
  RegisteredFamily family = synthetic::MakeFamily(synthetic::HexahedralSphere(4),
                                                  {{synthetic::Noise(1, 5.0F, 1.0F), {}}});
  family.domain_min = {-1.0F, -1.0F, -1.0F};
  family.domain_max = {1.0F, 0.5F, 1.0F};
  const std::vector<Float4> positions = Blend(family, {1.5}, All(family));
  int num_at_wall = 0;
  for (size_t v = 0; v < positions.size(); ++v) {
    for (int k = 0; k < 3; ++k) {
      EXPECT_GE(positions[v][k], std::min(family.domain_min[k], family.vertices[v][k]));
      EXPECT_LE(positions[v][k], std::max(family.domain_max[k], family.vertices[v][k]));
      num_at_wall += positions[v][k] == family.domain_max[k];
    }
  }
  EXPECT_GT(num_at_wall, 100);
}

TEST(Blender, KeepsTheEndSlabsOutsideOfTheAnimation) {
  const RegisteredFamily family = synthetic::MakeFamily(synthetic::HexahedralSphere(4),
                                                        {{synthetic::Noise(1, 0.1F, 20.0F), {}}});
  const VertexRange inner = Inner(family);
  for (const double w : {-1.0, 0.5, 2.0}) {
    const std::vector<Float4> positions = Blend(family, {w}, All(family));
    for (int32_t v = 0; v < inner[0]; ++v) EXPECT_LT(positions[v][3], 0.0F);
    for (size_t v = inner[1]; v < positions.size(); ++v) {
      EXPECT_GT(positions[v][3], static_cast<float>(family.num_frames - 1));
    }
  }
}

TEST(Blender, StaysFiniteWhereNumbersOverflow) {
  const auto huge = [](float sign) {
    return [sign](int64_t, const Eigen::Vector4f&) -> Eigen::Vector4f {
      return Eigen::Vector4f::Constant(sign * std::numeric_limits<float>::max());
    };
  };
  const RegisteredFamily family =
      synthetic::MakeFamily(synthetic::HexahedralSphere(2), {{huge(1.0F), {}}, {huge(-1.0F), {}}});
  for (const Float4& position : Blend(family, {2.0, 2.0}, All(family))) {
    for (const float x : position) EXPECT_TRUE(std::isfinite(x)) << x;
  }
}

}  // namespace
}  // namespace liquidblend::blend
