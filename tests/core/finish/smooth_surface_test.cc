#include "core/finish/smooth_surface.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "tests/synthetic/shapes.h"

namespace liquidblend::finish {
namespace {

// A sphere whose vertices are off by up to a third of an edge, in all directions.
mesh::TriangleMesh RoughSphere() {
  mesh::TriangleMesh sphere = synthetic::Icosphere({0, 0, 0}, 1.0, 4);
  const auto edge = static_cast<float>(mesh::MeanEdgeLength(sphere));
  std::mt19937 random(3);
  std::uniform_real_distribution<float> offset(-edge / 3, edge / 3);
  for (float& x : sphere.vertices.reshaped()) x += offset(random);
  return sphere;
}

mesh::TriangleMesh Smoothed(mesh::TriangleMesh surface, const SmoothingOptions& options) {
  SmoothSurface(options, surface);
  return surface;
}

double Roughness(const mesh::TriangleMesh& sphere) {
  return (sphere.vertices.colwise().norm().array() - sphere.vertices.colwise().norm().mean())
      .abs()
      .mean();
}

double WorstOffset(const mesh::TriangleMesh& a, const mesh::TriangleMesh& b) {
  return (a.vertices - b.vertices).colwise().norm().maxCoeff();
}

TEST(SmoothSurface, EvensOutAndKeepsTheTriangles) {
  const mesh::TriangleMesh rough = RoughSphere();
  for (const SmoothingKind kind : {SmoothingKind::kLaplacian, SmoothingKind::kTaubin}) {
    const mesh::TriangleMesh smooth = Smoothed(rough, {1, kind});
    EXPECT_TRUE(mesh::CheckClosed(smooth).closed());
    EXPECT_TRUE(smooth.triangles == rough.triangles);
    EXPECT_LT(Roughness(smooth), 0.75 * Roughness(rough));
    const mesh::TriangleMesh smoother = Smoothed(rough, {5, kind});
    EXPECT_LT(Roughness(smoother), 0.7 * Roughness(smooth));
  }
}

TEST(SmoothSurface, TaubinKeepsTheVolumeThatLaplacianLoses) {
  const mesh::TriangleMesh sphere = synthetic::Icosphere({0, 0, 0}, 1.0, 3);
  const double volume = mesh::Volume(sphere);
  const double laplacian = mesh::Volume(Smoothed(sphere, {5, SmoothingKind::kLaplacian})) / volume;
  const double taubin = mesh::Volume(Smoothed(sphere, {5, SmoothingKind::kTaubin})) / volume;
  EXPECT_LT(laplacian, 0.98);
  EXPECT_NEAR(taubin, 1.0, 0.005);
}

TEST(SmoothSurface, NoVertexGoesFurtherThanTheLimit) {
  const mesh::TriangleMesh drop = synthetic::Icosphere({0, 0, 0}, 1.0, 1);
  const double edge = mesh::MeanEdgeLength(drop);
  for (const double limit : {0.05, 0.5}) {
    const mesh::TriangleMesh smooth = Smoothed(drop, {32, SmoothingKind::kLaplacian, 1.0, limit});
    EXPECT_NEAR(WorstOffset(smooth, drop), limit * edge, 1e-5);
    EXPECT_GT(mesh::Volume(smooth), 0.0);
  }
}

TEST(SmoothSurface, NoPassesChangeNothing) {
  const mesh::TriangleMesh rough = RoughSphere();
  EXPECT_TRUE(Smoothed(rough, {}).vertices == rough.vertices);
  mesh::TriangleMesh empty;
  SmoothSurface({4, SmoothingKind::kTaubin}, empty);
  EXPECT_EQ(empty.num_vertices(), 0);
}

TEST(SmoothSurface, OptionsOutOfRangeAreRefusedByName) {
  const auto message = [](const SmoothingOptions& options) {
    const absl::Status status = options.Validate();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    return std::string(status.message());
  };
  SmoothingOptions options;
  EXPECT_TRUE(options.Validate().ok());
  options.passes = 33;
  EXPECT_THAT(message(options), testing::HasSubstr("passes is 33"));
  options = {};
  options.strength = std::nan("");
  EXPECT_THAT(message(options), testing::HasSubstr("strength is nan"));
  options = {};
  options.max_offset_edges = 0;
  EXPECT_THAT(message(options), testing::HasSubstr("max_offset_edges is 0"));
}

}  // namespace
}  // namespace liquidblend::finish
