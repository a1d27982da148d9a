// A drop that falls into a pool and leaves a crater there.
#pragma once

#include <algorithm>
#include <cmath>

#include "tests/worker/registration/registration_testing.h"

namespace liquidblend::registration {

struct StrikeOptions {
  double x = 0.0;            // where the drop falls, m
  double crater_x = 0.0;     // where the crater is, m; of a sound simulation there, too
  double crater_m = 0.45;    // its largest depth; 0: none
  double start_frame = 0.0;  // of all that happens
};

inline constexpr double kStrikeRadius = 0.25;     // of the drop, m
inline constexpr double kStrikeVelocity = 0.125;  // of its fall, m per frame
inline constexpr double kTouchFrame = 4.0;        // after the start
inline constexpr double kCraterRadius = 0.35;     // m
inline constexpr double kCraterFrame = 8.0;       // begins as the drop is gone ...
inline constexpr double kCraterFrames = 16.0;     // ... and lasts so long

// Depth of the crater at its middle. It is a half wave in time.
inline double CraterDepth(const StrikeOptions& options, double frame) {
  const double share = (frame - options.start_frame - kCraterFrame) / kCraterFrames;
  return share > 0 && share < 1 ? options.crater_m * std::sin(M_PI * share) : 0.0;
}

// The pool's top is z = 0.
inline mesh::Animation StrikeAnimation(const StrikeOptions& options, int num_frames = 28) {
  mesh::Animation animation;
  const synthetic::GridBox box = {
      .min_m = {-1.5f, -0.8f, -0.8f}, .max_m = {1.5f, 0.8f, 0.8f}, .spacing_m = 0.1};
  for (int k = 0; k < num_frames; ++k) {
    const double fallen = kStrikeVelocity * std::max(0.0, k - options.start_frame);
    const Eigen::Vector3d drop(options.x, 0,
                               kStrikeRadius + kTouchFrame * kStrikeVelocity - fallen);
    animation.frames.push_back(synthetic::Polygonize(
        [&](const Eigen::Vector3d& p) {
          const double r = std::hypot(p[0] - options.crater_x, p[1]);
          const double top =
              -CraterDepth(options, k) * std::exp(-(r * r) / (kCraterRadius * kCraterRadius));
          const double sides = std::max(std::abs(p[0]) - 1.37, std::abs(p[1]) - 0.67);
          const double pool = std::max({sides, -0.68 - p[2], p[2] - top});
          const bool is_gone = drop[2] < -kStrikeRadius;
          return is_gone ? pool : std::min(pool, (p - drop).norm() - kStrikeRadius);
        },
        box));
    animation.frames.back().velocities.setZero(3, animation.frames.back().num_vertices());
  }
  return animation;
}

inline mesh::SpaceTimeMesh StrikeMesh(const StrikeOptions& options) {
  return BuildMesh(StrikeAnimation(options));
}

}  // namespace liquidblend::registration
