// A drop that falls freely towards a pool.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>

#include "tests/worker/registration/registration_testing.h"

namespace liquidblend::registration {

constexpr double kFallRadius = 0.25;  // of the drop, m

// Heights in metres by frames: a free fall from rest.
inline std::function<double(double)> FallFrom(double height_m) {
  return [=](double k) { return height_m - 9.81 / (24 * 24) * k * k / 2; };
}

// A drop of 0.5 m above a pool, at a height that the time decides.
inline mesh::SpaceTimeMesh DropMesh(const std::function<double(double)>& height_m) {
  mesh::Animation animation;
  const synthetic::GridBox box = {
      .min_m = {-0.7f, -0.7f, -0.4f}, .max_m = {0.7f, 0.7f, 2.0f}, .spacing_m = 0.1};
  for (int k = 0; k < 16; ++k) {
    const Eigen::Vector3d drop(0, 0, height_m(k));
    animation.frames.push_back(synthetic::Polygonize(
        [&](const Eigen::Vector3d& p) {
          const double sides = std::max({std::abs(p[0]) - 0.6, std::abs(p[1]) - 0.6});
          const double pool = std::max({sides, -0.3 - p[2], p[2]});
          return std::min(pool, (p - drop).norm() - kFallRadius);
        },
        box));
    animation.frames.back().velocities.setZero(3, animation.frames.back().num_vertices());
  }
  return BuildMesh(animation);
}

}  // namespace liquidblend::registration
