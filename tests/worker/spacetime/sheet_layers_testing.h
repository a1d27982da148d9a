// A thin sheet of liquid sampled on the layers of a grid, for tests.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "tests/synthetic/sheet.h"
#include "worker/spacetime/nets/layers.h"

namespace liquidblend::spacetime {

inline constexpr float kSheetThickness = 0.3f;  // spacings
inline constexpr float kSheetRadius = 6.0f;
inline constexpr int kSheetFrames = 3;

// Flat and nearly across z, moving by `step` spacings a frame.
inline Layers SampleSheet(const Eigen::Vector3f& step, int num_threads = 2) {
  constexpr double kSpacing_m = 0.1;
  mesh::TriangleMesh sheet = synthetic::Sheet({.radius_m = kSheetRadius * kSpacing_m,
                                               .thickness_m = kSheetThickness * kSpacing_m,
                                               .edge_m = 0.1});
  const Eigen::Vector3f normal(0.2f, 0.35f, 1);
  sheet.vertices =
      (Eigen::Quaternionf::FromTwoVectors(Eigen::Vector3f::UnitZ(), normal).toRotationMatrix() *
       sheet.vertices)
          .eval();
  mesh::Animation animation;
  for (int k = 0; k < kSheetFrames; ++k) {
    mesh::TriangleMesh& frame = animation.frames.emplace_back(sheet);
    frame.vertices.colwise() += static_cast<float>(k * kSpacing_m) * step;
    frame.velocities = (static_cast<float>(animation.frames_per_second * kSpacing_m) * step)
                           .replicate(1, sheet.num_vertices());
  }
  auto layers = SampleLayers(
      animation,
      {.spacing_m = kSpacing_m, .max_motion_m = 3 * kSpacing_m, .keep_thin_sheets = true},
      parallel::Arena(num_threads), {});
  EXPECT_TRUE(layers.ok()) << layers.status();
  return *std::move(layers);
}

}  // namespace liquidblend::spacetime
