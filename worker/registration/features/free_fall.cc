#include "worker/registration/features/free_fall.h"

#include <Eigen/Dense>
#include <cmath>
#include <vector>

namespace liquidblend::registration {
namespace {

constexpr Eigen::Index kMinSlabs = 4;
constexpr double kMergeFrames = 1.0;
// Of a free fall: its smallest bend, edges, and the largest error as a share of it.
constexpr double kMinBend = 1.0, kMaxFallError = 0.1;

// Centres of the part while it is apart: sideways twice, height, time.
Eigen::Matrix4Xd CourseOf(const Track& track, const mesh::HeightAxis& height) {
  std::vector<Eigen::Vector4d> course;
  for (const Part& part : track.parts) {
    const double time = part.centre[3];
    if (time < track.start_time || time > track.end_time - kMergeFrames) continue;
    const int side = (height.axis + 1) % 3, other_side = (height.axis + 2) % 3;
    course.emplace_back(part.centre[side], part.centre[other_side],
                        height.sign * part.centre[height.axis], time);
  }
  Eigen::Matrix4Xd columns(4, static_cast<Eigen::Index>(course.size()));
  for (Eigen::Index n = 0; n < columns.cols(); ++n) columns.col(n) = course[n];
  return columns;
}

}  // namespace

double FreeFall::moved() const { return std::hypot(fallen, drift); }

bool FreeFall::is_free() const { return bend() >= kMinBend && error <= kMaxFallError * bend(); }

std::optional<FreeFall> FitFreeFall(const Track& track, mesh::Up up) {
  const Eigen::Matrix4Xd course = CourseOf(track, mesh::AxisOf(up));
  const Eigen::Index count = course.cols();
  if (count < kMinSlabs) return std::nullopt;
  Eigen::MatrixX3d powers(count, 3);
  powers.col(0).setOnes();
  powers.col(1) = course.row(3).transpose();
  powers.col(2) = powers.col(1).array().square();
  const Eigen::VectorXd heights = course.row(2).transpose();
  const Eigen::Vector3d parabola = powers.colPivHouseholderQr().solve(heights);
  const Eigen::Vector4d change = course.col(count - 1) - course.col(0);
  FreeFall fall;
  fall.acceleration = -2 * parabola[2];
  if (fall.acceleration != 0) fall.peak_time = parabola[1] / fall.acceleration;
  fall.frames = change[3];
  fall.fallen = -change[2];
  fall.drift = change.head<2>().norm();
  fall.error = (powers * parabola - heights).norm() / std::sqrt(static_cast<double>(count));
  return fall;
}

}  // namespace liquidblend::registration
