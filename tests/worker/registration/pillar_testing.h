// A pool with waves on it that stands around a pillar.
#pragma once

#include <algorithm>
#include <cmath>

#include "tests/worker/registration/registration_testing.h"

namespace liquidblend::registration {

constexpr double kPillarRadius = 0.25;

struct PillarOptions {
  double x = 0.0;        // of its middle, m
  double speed = 0.0;    // along x, m per frame
  bool is_round = true;  // or square
  int num_frames = 12;
  double radius = kPillarRadius;  // 0: no pillar
};

inline mesh::Animation PoolAroundPillar(const PillarOptions& options) {
  mesh::Animation animation;
  const synthetic::GridBox box = {
      .min_m = {-1.1f, -0.7f, -0.8f}, .max_m = {1.1f, 0.7f, 0.4f}, .spacing_m = 0.1};
  for (int k = 0; k < options.num_frames; ++k) {
    const double middle = options.x + options.speed * k;
    animation.frames.push_back(synthetic::Polygonize(
        [&](const Eigen::Vector3d& p) {
          const double sides = std::max(std::abs(p[0]) - 0.97, std::abs(p[1]) - 0.57);
          const double waves = 0.06 * std::sin(5 * p[0] - 0.9 * k);
          const double liquid = std::max({sides, -0.68 - p[2], p[2] - waves});
          const double dx = std::abs(p[0] - middle), dy = std::abs(p[1]);
          const double pillar = (options.is_round ? std::hypot(dx, dy) : std::max(dx, dy));
          return options.radius == 0 ? liquid : std::max(liquid, options.radius - pillar);
        },
        box));
  }
  return animation;
}

}  // namespace liquidblend::registration
