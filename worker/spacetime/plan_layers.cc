#include "worker/spacetime/plan_layers.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace liquidblend::spacetime {
namespace {

constexpr int kMaxSteps = 8;         // between two frames
constexpr size_t kFewVertices = 12;  // moving faster than the rest: not worth a layer

// Speed along the normal, metres per second: the motion that changes the surface's place. Falls in
// `kFewVertices` steps off the fastest.
double SurfaceSpeed(const mesh::TriangleMesh& frame) {
  if (frame.velocities.cols() == 0) return 0.0;
  Eigen::Matrix3Xf normals = Eigen::Matrix3Xf::Zero(3, frame.num_vertices());
  for (int64_t t = 0; t < frame.num_triangles(); ++t) {
    const Eigen::Vector3i triangle = frame.triangles.col(t);
    const Eigen::Vector3f a = frame.vertices.col(triangle[0]);
    const Eigen::Vector3f ab = frame.vertices.col(triangle[1]) - a;
    const Eigen::Vector3f ac = frame.vertices.col(triangle[2]) - a;
    for (const int v : triangle) normals.col(v) += ab.cross(ac);
  }
  std::vector<float> speeds(frame.num_vertices());
  for (int64_t v = 0; v < frame.num_vertices(); ++v) {
    speeds[v] = std::abs(frame.velocities.col(v).dot(normals.col(v).stableNormalized()));
  }
  if (speeds.size() <= kFewVertices) return 0.0;
  std::nth_element(speeds.begin(), speeds.begin() + kFewVertices, speeds.end(), std::greater<>());
  return speeds[kFewVertices];
}

}  // namespace

std::vector<LayerTime> PlanLayers(const mesh::Animation& animation, double max_motion_m) {
  const int last = animation.num_frames() - 1;
  std::vector<LayerTime> layers = {{-1.0, 0, 0, 0.0}};
  double speed = SurfaceSpeed(animation.frames[0]);
  for (int k = 0; k < last; ++k) {
    const double next_speed = SurfaceSpeed(animation.frames[k + 1]);
    const double begin = animation.time(k), length = animation.time(k + 1) - begin;
    // Without velocities on one side the other side's frame cannot be met half-way.
    const double motion_m = std::min(speed, next_speed) > 0
                                ? std::max(speed, next_speed) * length / animation.frames_per_second
                                : 0.0;
    const int num_steps =
        std::clamp(static_cast<int>(std::ceil(motion_m / max_motion_m)), 1, kMaxSteps);
    layers.push_back({begin, k, k, 0.0});
    for (int step = 1; step < num_steps; ++step) {
      const double share = static_cast<double>(step) / num_steps;
      layers.push_back({begin + share * length, k, k + 1, share});
    }
    speed = next_speed;
  }
  layers.push_back({animation.time(last), last, last, 0.0});
  layers.push_back({animation.time(last) + 1.0, last, last, 0.0});
  return layers;
}

Eigen::Matrix3Xf Advected(const mesh::Animation& animation, int frame, double frames) {
  const mesh::TriangleMesh& mesh = animation.frames[frame];
  if (frames == 0.0 || mesh.velocities.cols() == 0) return mesh.vertices;
  return mesh.vertices + static_cast<float>(frames / animation.frames_per_second) * mesh.velocities;
}

}  // namespace liquidblend::spacetime
