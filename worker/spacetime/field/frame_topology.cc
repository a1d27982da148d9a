#include "worker/spacetime/field/frame_topology.h"

#include <Eigen/Geometry>
#include <functional>
#include <map>
#include <numeric>
#include <queue>
#include <utility>

namespace liquidblend::spacetime {

FrameTopology::FrameTopology(const mesh::TriangleMesh& frame)
    : frame_(&frame), first_(frame.num_vertices() + 1, 0), triangles_(frame.triangles.size()) {
  for (const int v : frame.triangles.reshaped()) ++first_[v + 1];
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
  std::vector<int32_t> next = first_;
  for (int32_t t = 0; t < frame.num_triangles(); ++t) {
    for (const int32_t v : CornersOf(frame, t)) triangles_[next[v]++] = t;
  }
}

int32_t FrameTopology::Find(const Corners& corners) const {
  for (const int32_t v : corners) {
    if (v < 0 || v >= num_vertices()) return -1;
  }
  for (const int32_t t : TrianglesAt(corners[0])) {
    const Corners c = CornersOf(*frame_, t);
    for (int k = 0; k < 3; ++k) {
      if (Corners{c[k], c[(k + 1) % 3], c[(k + 2) % 3]} == corners) return t;
    }
  }
  return -1;
}

int32_t FrameTopology::Opposite(int32_t a, int32_t b) const {
  for (const int32_t t : TrianglesAt(a)) {
    const Corners c = CornersOf(*frame_, t);
    for (int k = 0; k < 3; ++k) {
      if (c[k] == a && c[(k + 1) % 3] == b) return c[(k + 2) % 3];
    }
  }
  return -1;
}

bool FrameTopology::IsNear(int32_t a, int32_t b, float limit) const {
  const Eigen::Matrix3Xf& at = frame_->vertices;
  // Most are next to each other.
  const float straight = (at.col(b) - at.col(a)).norm();
  if (straight < limit && (a == b || Opposite(a, b) >= 0 || Opposite(b, a) >= 0)) return true;
  using Reached = std::pair<float, int32_t>;  // distance, vertex
  std::priority_queue<Reached, std::vector<Reached>, std::greater<>> queue;
  std::map<int32_t, float> distance = {{a, 0.0f}};
  for (queue.emplace(0.0f, a); !queue.empty();) {
    const auto [reached, v] = queue.top();
    queue.pop();
    if (v == b) return reached < limit;
    if (reached > distance[v]) continue;
    for (const int32_t t : TrianglesAt(v)) {
      for (const int32_t w : CornersOf(*frame_, t)) {
        const float way = reached + (at.col(w) - at.col(v)).norm();
        if (way >= limit) continue;
        const auto [known, is_new] = distance.try_emplace(w, way);
        if (!is_new && known->second <= way) continue;
        known->second = way;
        queue.emplace(way, w);
      }
    }
  }
  return false;
}

Eigen::Matrix3Xf VertexNormals(const mesh::TriangleMesh& frame) {
  Eigen::Matrix3Xf normals = Eigen::Matrix3Xf::Zero(3, frame.num_vertices());
  for (int64_t t = 0; t < frame.num_triangles(); ++t) {
    const Corners c = CornersOf(frame, t);
    const Eigen::Vector3f a = frame.vertices.col(c[0]);
    const Eigen::Vector3f ab = frame.vertices.col(c[1]) - a;
    const Eigen::Vector3f ac = frame.vertices.col(c[2]) - a;
    const Eigen::Vector3f doubled_area = ab.cross(ac);
    for (const int32_t v : c) normals.col(v) += doubled_area;
  }
  for (int64_t v = 0; v < normals.cols(); ++v) normals.col(v).stableNormalize();
  return normals;
}

}  // namespace liquidblend::spacetime
