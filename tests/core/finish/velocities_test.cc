#include "core/finish/velocities.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <memory>

#include "core/finish/normals.h"
#include "tests/core/finish/finish_testing.h"
#include "tests/synthetic/families.h"

namespace liquidblend::finish::velocities_test {
namespace {

constexpr float kFramesPerSecond = 24.0F;
constexpr float kGrowth = 0.02F;  // of the radius of 1 m, per frame

synthetic::ComplexOptions Moving() {
  synthetic::ComplexOptions options;
  options.num_frames = 12;
  options.velocity_m_per_frame = {0.05F, 0.02F, 0.04F};
  options.growth_per_frame = kGrowth;
  return options;
}

// Of the point that is at `position` at this frame; m/s.
Eigen::Vector3f TrueVelocity(const Eigen::Vector3f& position, float frame) {
  const Eigen::Vector3f centre = frame * Moving().velocity_m_per_frame;
  const Eigen::Vector3f growth = kGrowth / (1.0F + kGrowth * frame) * (position - centre);
  return kFramesPerSecond * (Moving().velocity_m_per_frame + growth);
}

// The moving sphere, which knows its velocities, and what `targets` make of it.
mesh::RegisteredFamily KnowingFamily(const std::vector<synthetic::TargetFields>& targets) {
  mesh::RegisteredFamily family =
      synthetic::MakeFamily(synthetic::HexahedralSphere(16, Moving()), targets);
  struct Storage {
    std::shared_ptr<const void> family;
    std::vector<mesh::Float3> velocities;
  };
  const auto storage = std::make_shared<Storage>();
  storage->family = family.storage;
  for (const mesh::Float4& vertex : family.vertices) {
    const Eigen::Vector3f velocity =
        TrueVelocity(Eigen::Vector3f(vertex[0], vertex[1], vertex[2]), vertex[3]);
    storage->velocities.push_back({velocity.x(), velocity.y(), velocity.z()});
  }
  family.velocities = storage->velocities;
  family.storage = storage;
  return family;
}

mesh::TriangleMesh CutWithVelocities(Slicer& slicer, const std::vector<double>& weights,
                                     double frame) {
  mesh::TriangleMesh surface = slicer.Cut(weights, frame);
  slicer.AddVelocitiesTo(surface);
  return surface;
}

// Mean length of the difference to truth(position), m/s.
template <typename Truth>
double MeanError(const mesh::TriangleMesh& surface, const Truth& truth) {
  double sum = 0.0;
  for (Eigen::Index v = 0; v < surface.num_vertices(); ++v) {
    sum += (surface.velocities.col(v) - truth(Eigen::Vector3f(surface.vertices.col(v)))).norm();
  }
  return sum / static_cast<double>(surface.num_vertices());
}

TEST(AddVelocities, TheSlopeGivesTheNormalVelocityOfAMovingSphere) {
  Slicer slicer(synthetic::MakeFamily(synthetic::HexahedralSphere(16, Moving()), {}));
  for (const float frame : {0.0F, 3.5F, 7.0F}) {
    const mesh::TriangleMesh surface = CutWithVelocities(slicer, {}, frame);
    const Eigen::Vector3f centre = frame * Moving().velocity_m_per_frame;
    const double error = MeanError(surface, [&](const Eigen::Vector3f& position) {
      const Eigen::Vector3f normal = (position - centre).normalized();
      return Eigen::Vector3f(normal.dot(TrueVelocity(position, frame)) * normal);
    });
    std::printf("slope at frame %.1f: mean error %.4f m/s of speeds up to 2.1\n", frame, error);
    EXPECT_LT(error, 0.02);
  }
}

TEST(AddVelocities, AtWeightZeroTheyAreTheSimulationsOwn) {
  Slicer slicer(KnowingFamily({{synthetic::SmoothWarp(1, 0.3F, 2.0F), {}}}));
  for (const float frame : {2.0F, 5.3F}) {
    const mesh::TriangleMesh surface = CutWithVelocities(slicer, {0.0}, frame);
    const double error = MeanError(
        surface, [&](const Eigen::Vector3f& position) { return TrueVelocity(position, frame); });
    EXPECT_LT(error, 2e-3);  // linear between frames, the truth is not quite
  }
}

TEST(AddVelocities, ABlendThatRunsFasterHasProportionalVelocities) {
  // At weight 1 everything happens at 0.8 t.
  Slicer slicer(KnowingFamily(
      {{[](int64_t, const Eigen::Vector4f& at) { return Eigen::Vector4f(0, 0, 0, -0.2F * at[3]); },
        {}}}));
  const mesh::TriangleMesh surface = CutWithVelocities(slicer, {1.0}, 4.0);
  const double error = MeanError(surface, [&](const Eigen::Vector3f& position) {
    return Eigen::Vector3f(TrueVelocity(position, 5.0F) / 0.8F);
  });
  std::printf("time-warped: mean error %.4f m/s of speeds up to 2.6\n", error);
  EXPECT_LT(error, 0.02);
}

TEST(AddVelocities, ABlendThatStretchesSpaceStretchesVelocities) {
  // At weight 1 x is 1.25 times as far, and everything drifts along y by 0.03 m a frame.
  Slicer slicer(KnowingFamily({{[](int64_t, const Eigen::Vector4f& at) {
                                  return Eigen::Vector4f(0.25F * at[0], 0.03F * at[3], 0, 0);
                                },
                                {}}}));
  const mesh::TriangleMesh surface = CutWithVelocities(slicer, {1.0}, 4.0);
  const double error = MeanError(surface, [&](const Eigen::Vector3f& position) {
    const Eigen::Vector3f source(position.x() / 1.25F, position.y() - 0.12F, position.z());
    const Eigen::Vector3f u = TrueVelocity(source, 4.0F);
    return Eigen::Vector3f(1.25F * u.x(), u.y() + 0.03F * kFramesPerSecond, u.z());
  });
  EXPECT_LT(error, 0.02);
}

TEST(AddVelocities, StayFiniteHoweverTheBlendFolds) {
  for (const bool knows : {false, true}) {
    mesh::RegisteredFamily family =
        KnowingFamily({{synthetic::Noise(1, 0.5F, 3.0F), synthetic::Noise(2, 0.2F, 2.0F)}});
    if (!knows) family.velocities = {};
    Slicer slicer(std::move(family));
    for (const double weight : {-1.0, 0.5, 2.0}) {
      const mesh::TriangleMesh surface = CutWithVelocities(slicer, {weight}, 5.2);
      ASSERT_EQ(surface.velocities.cols(), surface.num_vertices());
      EXPECT_TRUE(surface.velocities.allFinite()) << weight;
    }
  }
}

}  // namespace
}  // namespace liquidblend::finish::velocities_test
