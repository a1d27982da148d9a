// Intersection of rays with a triangle mesh. No other file uses Embree.
#pragma once

#include <embree3/rtcore.h>

#include <limits>
#include <memory>
#include <vector>

#include "absl/status/statusor.h"
#include "client/cli/render/camera.h"
#include "liquidblend/mesh.h"

namespace liquidblend::render {

struct Hit {
  float distance = 0.0f;
  Vector point;
  Vector geometric_normal;  // unit length, outward
  Vector normal;            // smooth, unit length, outward
};

// Threads: rays are safe from any number of threads.
class Scene {
 public:
  // Errors: kInternal if Embree cannot start.
  static absl::StatusOr<std::unique_ptr<Scene>> Make(const Mesh& mesh);
  ~Scene();
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  // The nearest hit farther than `near`; false if there is none.
  bool Intersect(const Ray& ray, float near, Hit* hit) const;

  // For a ray inside the liquid: the hit where it leaves it. Surfaces within the liquid, where
  // parts of it overlap, are skipped. False if it never leaves.
  bool Leave(const Ray& ray, float near, Hit* hit) const;

  // True if anything lies between `near` and `far`.
  bool Occluded(const Ray& ray, float near,
                float far = std::numeric_limits<float>::infinity()) const;

 private:
  Scene(RTCDevice device, const Mesh& mesh);
  Hit HitAt(const Ray& ray, float distance, const RTCHit& found) const;

  RTCDevice device_;
  RTCScene scene_;
  std::vector<uint32_t> triangles_;
  std::vector<float> normals_;  // x, y, z per vertex
};

}  // namespace liquidblend::render
