#include "worker/spacetime/nets/plan_layers.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <utility>

#include "worker/spacetime/field/frame_topology.h"

namespace liquidblend::spacetime {
namespace {

constexpr size_t kFewVertices = 12;  // moving faster than the rest: not worth a layer
constexpr int kPathMargin = 2;       // voxels around the path of a vertex

// Per vertex: speed along the normal, metres per second, which is the motion that changes the
// surface's place. Empty without velocities.
std::vector<float> SurfaceSpeeds(const mesh::TriangleMesh& frame) {
  if (frame.velocities.cols() == 0) return {};
  const Eigen::Matrix3Xf normals = VertexNormals(frame);
  std::vector<float> speeds(frame.num_vertices());
  for (int64_t v = 0; v < frame.num_vertices(); ++v) {
    speeds[v] = std::abs(frame.velocities.col(v).dot(normals.col(v)));
  }
  return speeds;
}

// `kFewVertices` steps off the fastest.
double SurfaceSpeed(std::vector<float> speeds) {
  if (speeds.size() <= kFewVertices) return 0.0;
  std::nth_element(speeds.begin(), speeds.begin() + kFewVertices, speeds.end(), std::greater<>());
  return speeds[kFewVertices];
}

int NumSteps(double motion_m, double max_motion_m) {
  const double steps = std::min(std::ceil(motion_m / max_motion_m), 1.0 * SlabSteps::kMaxSteps);
  return static_cast<int>(std::bit_ceil(static_cast<unsigned>(std::max(steps, 1.0))));
}

}  // namespace

LayerPlan PlanLayers(const mesh::Animation& animation, double max_motion_m) {
  const int last = animation.num_frames() - 1;
  LayerPlan plan;
  const auto add = [&](const LayerTime& layer, bool begins_slab) {
    if (begins_slab) plan.first_layer.push_back(static_cast<int>(plan.layers.size()));
    plan.layers.push_back(layer);
  };
  add({animation.time(0) - 1.0, 0, 0, 0.0}, true);
  double speed = SurfaceSpeed(SurfaceSpeeds(animation.frames[0]));
  for (int k = 0; k < last; ++k) {
    const double next_speed = SurfaceSpeed(SurfaceSpeeds(animation.frames[k + 1]));
    const double begin = animation.time(k), length = animation.time(k + 1) - begin;
    // Without velocities on one side the other side's frame cannot be met half-way.
    // The frames of a pre-roll rest, whatever the velocities.
    const double motion_m = std::min(speed, next_speed) > 0 && k >= animation.num_pre_roll
                                ? std::max(speed, next_speed) * length / animation.frames_per_second
                                : 0.0;
    const int num_steps = NumSteps(motion_m, max_motion_m);
    add({begin, k, k, 0.0}, true);
    for (int step = 1; step < num_steps; ++step) {
      const double share = static_cast<double>(step) / num_steps;
      add({begin + share * length, k, k + 1, share}, false);
    }
    speed = next_speed;
  }
  add({animation.time(last), last, last, 0.0}, true);
  add({animation.time(last) + 1.0, last, last, 0.0}, true);
  return plan;
}

SlabSteps PlanSteps(const mesh::Animation& animation, const LayerPlan& plan, int slab,
                    const Grid& grid, double max_motion_m) {
  SlabSteps steps(grid, plan.num_steps(slab));
  if (steps.num_steps() == 1) return steps;
  const LayerTime &begin = plan.layers[plan.first_layer[slab]],
                  &end = plan.layers[plan.first_layer[slab + 1]];
  const auto refine_along = [&](int frame, double frames) {
    const std::vector<float> speeds = SurfaceSpeeds(animation.frames[frame]);
    const Eigen::Matrix3Xf moved = Advected(animation, frame, frames);
    const double seconds = std::abs(frames) / animation.frames_per_second;
    for (int64_t v = 0; v < moved.cols(); ++v) {
      const int wanted = std::min(NumSteps(speeds[v] * seconds, max_motion_m), steps.num_steps());
      if (wanted == 1) continue;
      const Eigen::Vector3d from =
          (animation.frames[frame].vertices.col(v).cast<double>() - grid.origin_m) / grid.spacing_m;
      const Eigen::Vector3d to = (moved.col(v).cast<double>() - grid.origin_m) / grid.spacing_m;
      const int count = 1 + static_cast<int>((to - from).norm() / SlabSteps::kBlock);
      for (int n = 0; n <= count; ++n) {
        const Eigen::Vector3i voxel = (from + n * (to - from) / count).array().floor().cast<int>();
        steps.Refine({voxel[0] - kPathMargin, voxel[1] - kPathMargin, voxel[2] - kPathMargin},
                     {voxel[0] + kPathMargin, voxel[1] + kPathMargin, voxel[2] + kPathMargin},
                     wanted);
      }
    }
  };
  refine_along(begin.earlier, end.time - begin.time);
  refine_along(end.earlier, begin.time - end.time);
  return steps;
}

Eigen::Matrix3Xf Advected(const mesh::Animation& animation, int frame, double frames) {
  const mesh::TriangleMesh& mesh = animation.frames[frame];
  const bool rests = frame < animation.num_pre_roll;
  if (frames == 0.0 || rests || mesh.velocities.cols() == 0) return mesh.vertices;
  return mesh.vertices + static_cast<float>(frames / animation.frames_per_second) * mesh.velocities;
}

}  // namespace liquidblend::spacetime
