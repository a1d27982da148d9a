#include "client/cli/render/camera.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "absl/strings/str_cat.h"
#include "client/src/status_macros.h"

namespace liquidblend::render {
namespace {

constexpr float kHalfFieldOfView = 0.24f;  // radians, of the height
constexpr float kMargin = 1.04f;

float ToRadians(double degrees) { return static_cast<float>(degrees * std::numbers::pi / 180.0); }

Vector Corner(const Bounds& bounds, int index) {
  return Vector(static_cast<float>(index & 1 ? bounds.max.x : bounds.min.x),
                static_cast<float>(index & 2 ? bounds.max.y : bounds.min.y),
                static_cast<float>(index & 4 ? bounds.max.z : bounds.min.z));
}

absl::Status CheckRange(const char* field, double value, double lowest, double highest) {
  if (value >= lowest && value <= highest) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(field, " is ", value, "; it must be in [", lowest, ", ", highest, "]"));
}

}  // namespace

absl::Status CameraOptions::Validate() const {
  LBC_RETURN_IF_ERROR(CheckRange("camera azimuth", azimuth_deg, -360.0, 360.0));
  LBC_RETURN_IF_ERROR(CheckRange("camera elevation", elevation_deg, -89.0, 89.0));
  return CheckRange("camera zoom", zoom, 0.1, 10.0);
}

Camera::Camera(const Bounds& bounds, double aspect, const CameraOptions& options) {
  const float azimuth = ToRadians(options.azimuth_deg);
  const float elevation = ToRadians(options.elevation_deg);
  forward_ = -Vector(std::sin(azimuth) * std::cos(elevation),
                     -std::cos(azimuth) * std::cos(elevation), std::sin(elevation));
  const Vector right = forward_.cross(Vector::UnitZ()).normalized();
  const Vector up = right.cross(forward_);
  const float half_height = std::tan(kHalfFieldOfView);
  const float half_width = half_height * static_cast<float>(aspect);

  // Step back until each corner is inside.
  const Vector center = 0.5f * (Corner(bounds, 0) + Corner(bounds, 7));
  float distance = 1e-3f;
  for (int i = 0; i < 8; ++i) {
    const Vector corner = Corner(bounds, i) - center;
    const float across =
        std::max(std::abs(corner.dot(right)) / half_width, std::abs(corner.dot(up)) / half_height);
    distance = std::max(distance, kMargin * across - corner.dot(forward_));
  }
  origin_ = center - forward_ * (distance / static_cast<float>(options.zoom));
  right_ = right * half_width;
  up_ = up * half_height;
}

Ray Camera::MakeRay(float x, float y) const {
  const Vector direction = forward_ + (2.0f * x - 1.0f) * right_ + (1.0f - 2.0f * y) * up_;
  return {origin_, direction.normalized()};
}

}  // namespace liquidblend::render
