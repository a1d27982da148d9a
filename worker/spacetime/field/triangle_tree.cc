#include "worker/spacetime/field/triangle_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "worker/spacetime/field/distance_band.h"

namespace liquidblend::spacetime {
namespace {

constexpr int kLeafTriangles = 6;
constexpr int kMaxDepth = 64;  // halves of 2^31 triangles are leaves long before

Eigen::Matrix3f CornersOf(const mesh::TriangleMesh& surface, int32_t triangle) {
  Eigen::Matrix3f corners;
  for (int c = 0; c < 3; ++c) corners.col(c) = surface.vertices.col(surface.triangles(c, triangle));
  return corners;
}

}  // namespace

TriangleTree::TriangleTree(const mesh::TriangleMesh& surface)
    : surface_(surface), triangles_(surface.num_triangles()) {
  if (triangles_.empty()) return;
  std::iota(triangles_.begin(), triangles_.end(), 0);
  Eigen::Matrix3Xf centres(3, surface.num_triangles());
  for (int32_t t = 0; t < surface.num_triangles(); ++t) {
    centres.col(t) = CornersOf(surface, t).rowwise().mean();
  }
  AddNode(centres, 0, static_cast<int32_t>(triangles_.size()));
}

int32_t TriangleTree::AddNode(const Eigen::Matrix3Xf& centres, int32_t begin, int32_t end) {
  const auto index = static_cast<int32_t>(nodes_.size());
  nodes_.emplace_back();
  Eigen::AlignedBox3f box, box_of_centres;
  for (int32_t n = begin; n < end; ++n) {
    const Eigen::Matrix3f corners = CornersOf(surface_, triangles_[n]);
    for (int c = 0; c < 3; ++c) box.extend(corners.col(c));
    box_of_centres.extend(centres.col(triangles_[n]));
  }
  nodes_[index].box = box;
  if (end - begin <= kLeafTriangles) {
    nodes_[index].begin = begin;
    nodes_[index].end = end;
    return index;
  }
  int axis = 0;
  box_of_centres.sizes().maxCoeff(&axis);
  const int32_t middle = begin + (end - begin) / 2;
  std::nth_element(triangles_.begin() + begin, triangles_.begin() + middle,
                   triangles_.begin() + end, [&](int32_t a, int32_t b) {
                     return std::pair(centres(axis, a), a) < std::pair(centres(axis, b), b);
                   });
  AddNode(centres, begin, middle);
  const int32_t second = AddNode(centres, middle, end);
  nodes_[index].second = second;
  return index;
}

float TriangleTree::LeafDistanceSq(const Node& leaf, const Eigen::Vector3f& point) const {
  float best_sq = std::numeric_limits<float>::infinity();
  for (int32_t n = leaf.begin; n < leaf.end; ++n) {
    // Around the point, so that no digits are lost far from the origin.
    const Eigen::Matrix3f corners = CornersOf(surface_, triangles_[n]).colwise() - point;
    const Eigen::Vector3f weights =
        ClosestBarycentric(Eigen::Vector3f::Zero(), corners.col(0), corners.col(1), corners.col(2));
    best_sq = std::min(best_sq, (corners * weights).squaredNorm());
  }
  return best_sq;
}

float TriangleTree::Distance(const Eigen::Vector3f& point) const {
  std::array<std::pair<float, int32_t>, kMaxDepth> open;  // squared distance to the box, node
  int num_open = 0;
  const auto push = [&](int32_t node) {
    open[num_open++] = {nodes_[node].box.squaredExteriorDistance(point), node};
  };
  float best_sq = std::numeric_limits<float>::infinity();
  push(0);
  while (num_open > 0) {
    const auto [box_sq, n] = open[--num_open];
    if (box_sq >= best_sq) continue;
    const Node& node = nodes_[n];
    if (node.second < 0) {
      best_sq = std::min(best_sq, LeafDistanceSq(node, point));
      continue;
    }
    push(n + 1);
    push(node.second);
    if (open[num_open - 1].first > open[num_open - 2].first) {
      std::swap(open[num_open - 1], open[num_open - 2]);  // the nearer one is next
    }
  }
  return std::sqrt(best_sq);
}

}  // namespace liquidblend::spacetime
