#include "core/mesh/animation.h"

#include <cassert>
#include <numeric>

namespace liquidblend::mesh {

void AddPreRoll(const TriangleMesh& surface, int count, Animation& animation) {
  assert(animation.num_pre_roll == 0);
  animation.frames.insert(animation.frames.begin(), count, surface);
  if (!animation.times.empty()) {
    animation.times.insert(animation.times.begin(), count, 0.0);
    std::iota(animation.times.begin(), animation.times.begin() + count, -1.0 * count);
  }
  animation.num_pre_roll = count;
}

double MeanEdgeLength(const Animation& animation) {
  double sum = 0.0;
  int64_t num_triangles = 0;
  for (int k = animation.num_pre_roll; k < animation.num_frames(); ++k) {
    const TriangleMesh& frame = animation.frames[k];
    sum += MeanEdgeLength(frame) * static_cast<double>(frame.num_triangles());
    num_triangles += frame.num_triangles();
  }
  return num_triangles == 0 ? 0.0 : sum / static_cast<double>(num_triangles);
}

Eigen::Matrix<float, 3, 2> Bounds(const Animation& animation) {
  Eigen::Matrix<float, 3, 2> bounds = Eigen::Matrix<float, 3, 2>::Zero();
  bool is_first = true;
  for (const TriangleMesh& frame : animation.frames) {
    if (frame.num_vertices() == 0) continue;
    const Eigen::Vector3f low = frame.vertices.rowwise().minCoeff();
    const Eigen::Vector3f high = frame.vertices.rowwise().maxCoeff();
    bounds.col(0) = is_first ? low : bounds.col(0).cwiseMin(low).eval();
    bounds.col(1) = is_first ? high : bounds.col(1).cwiseMax(high).eval();
    is_first = false;
  }
  return bounds;
}

}  // namespace liquidblend::mesh
