// Points and boxes in space, metres.
#pragma once

namespace liquidblend {

struct Vector3 {
  double x = 0.0;
  double y = 0.0;
  double z = 0.0;
};

struct Bounds {
  Vector3 min;
  Vector3 max;
};

}  // namespace liquidblend
