// Studio around the liquid: a bright room, a floor, a large soft lamp.
#pragma once

#include "client/cli/render/camera.h"
#include "client/cli/render/scene.h"

namespace liquidblend::render {

// Random numbers of one ray path: the same for a pixel and sample wherever it is computed.
class Random {
 public:
  Random(uint32_t x, uint32_t y, uint32_t sample);
  float Next();  // [0, 1)

 private:
  uint32_t state_;
};

// Light that arrives at a point. Colors are linear red, green, blue.
class Studio {
 public:
  // The floor lies under `bounds`; `size` is the length that distances are compared with.
  Studio(const Scene& scene, const Bounds& bounds);

  float size() const { return size_; }
  float epsilon() const { return 1e-4f * size_; }

  // Light along a ray that misses the liquid.
  Vector Background(const Ray& ray, Random& random) const;

  // Light on a surface that scatters evenly: lamp with soft shadow, room with ambient occlusion.
  Vector Lighting(const Vector& point, const Vector& normal, Random& random) const;

 private:
  Vector Room(const Vector& direction) const;
  float LampShare(const Vector& point, Random& random) const;
  float Openness(const Vector& point, const Vector& normal, Random& random) const;

  const Scene& scene_;
  Vector center_;
  float floor_z_;
  float size_;
};

}  // namespace liquidblend::render
