// Camera of a picture. z is up.
#pragma once

#include <Eigen/Core>

#include "absl/status/status.h"
#include "liquidblend/bounds.h"

namespace liquidblend::render {

using Vector = Eigen::Vector3f;

struct CameraOptions {
  double azimuth_deg = 0.0;       // 0: from the front, looking along +y; 90: from the right (+x)
  double elevation_deg = 16.0;    // above the horizon; [-89, 89]
  double zoom = 1.0;              // [0.1, 10]; 1: the bounds just fit
  absl::Status Validate() const;  // names the first field out of range, and its value
};

struct Ray {
  Vector origin;
  Vector direction;  // unit length
};

class Camera {
 public:
  // Frames `bounds` in a picture of the given width over height.
  Camera(const Bounds& bounds, double aspect, const CameraOptions& options);

  // The ray through (x, y) of the picture, both in [0, 1], from the top left.
  Ray MakeRay(float x, float y) const;

 private:
  Vector origin_;
  Vector forward_;
  Vector right_;  // half a picture wide at distance 1
  Vector up_;     // half a picture high at distance 1
};

}  // namespace liquidblend::render
