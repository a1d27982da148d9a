#include "worker/registration/closest_point.h"

#include <Eigen/LU>
#include <array>
#include <limits>
#include <nanoflann.hpp>
#include <utility>

namespace liquidblend::registration {
namespace {

constexpr int kProjectionSteps = 3;

// Of [begin, end), those outside of rigid pieces.
std::vector<int32_t> FreeVertices(const mesh::SpaceTimeMesh& mesh, int64_t begin, int64_t end) {
  const std::vector<char> rigid = mesh::RigidVertices(mesh);
  std::vector<int32_t> indices;
  for (int64_t v = begin; v < end; ++v) {
    if (!rigid[v]) indices.push_back(static_cast<int32_t>(v));
  }
  return indices;
}

// The end slabs' vertices with time zero; other columns are not used.
Points Flatten(const Points& points) {
  Points flat = points;
  flat.row(3).setZero();
  return flat;
}

// Where a cell's point with parameters s lies, as weights of its corners; `slope` per parameter.
struct Shape {
  int num_corners;
  std::array<float, 8> weight;
  std::array<std::array<float, 3>, 8> slope;
};

Shape HexahedronShape(const Eigen::Vector3f& s) {
  Shape shape{8, {}, {}};
  for (int c = 0; c < 8; ++c) {
    std::array<float, 3> f, d;
    for (int a = 0; a < 3; ++a) {
      const bool upper = (c >> a & 1) != 0;
      f[a] = upper ? s[a] : 1 - s[a];
      d[a] = upper ? 1.0f : -1.0f;
    }
    shape.weight[c] = f[0] * f[1] * f[2];
    shape.slope[c] = {d[0] * f[1] * f[2], f[0] * d[1] * f[2], f[0] * f[1] * d[2]};
  }
  return shape;
}

Shape WedgeShape(const Eigen::Vector3f& s) {  // s.x + s.y <= 1
  Shape shape{6, {}, {}};
  const std::array<float, 3> f = {1 - s.x() - s.y(), s.x(), s.y()};
  constexpr std::array<std::array<float, 2>, 3> kSlope = {{{-1, -1}, {1, 0}, {0, 1}}};
  for (int c = 0; c < 6; ++c) {
    const float g = c < 3 ? 1 - s.z() : s.z();
    shape.weight[c] = f[c % 3] * g;
    shape.slope[c] = {kSlope[c % 3][0] * g, kSlope[c % 3][1] * g, c < 3 ? -f[c % 3] : f[c % 3]};
  }
  return shape;
}

Shape PyramidShape(const Eigen::Vector3f& s) {
  constexpr std::array<std::array<int, 2>, 4> kCorner = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
  Shape shape{5, {}, {}};
  for (int c = 0; c < 4; ++c) {
    const float fx = kCorner[c][0] ? s.x() : 1 - s.x(), dx = kCorner[c][0] ? 1.0f : -1.0f;
    const float fy = kCorner[c][1] ? s.y() : 1 - s.y(), dy = kCorner[c][1] ? 1.0f : -1.0f;
    const float g = 1 - s.z();
    shape.weight[c] = fx * fy * g;
    shape.slope[c] = {dx * fy * g, fx * dy * g, -fx * fy};
  }
  shape.weight[4] = s.z();
  shape.slope[4] = {0, 0, 1};
  return shape;
}

Shape TetrahedronShape(const Eigen::Vector3f& s) {
  return {4, {1 - s.sum(), s.x(), s.y(), s.z()}, {{{-1, -1, -1}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}};
}

Shape ShapeOf(size_t num_corners, const Eigen::Vector3f& s) {
  switch (num_corners) {
    case 8:
      return HexahedronShape(s);
    case 6:
      return WedgeShape(s);
    case 5:
      return PyramidShape(s);
    default:
      return TetrahedronShape(s);
  }
}

// Parameters brought back into the cell: a box, or a simplex in the first `simplex` of them.
Eigen::Vector3f ClampToCell(size_t num_corners, Eigen::Vector3f s) {
  s = s.cwiseMax(0.0f).cwiseMin(1.0f);
  const float sum = num_corners == 6 ? s.head<2>().sum() : num_corners == 4 ? s.sum() : 0.0f;
  if (sum > 1) s.head(num_corners == 6 ? 2 : 3) /= sum;
  return s;
}

}  // namespace

// ---- PointTree ----------------------------------------------------------------------------------

struct PointTree::Impl {
  struct Adaptor {
    const Points& points;
    std::vector<int32_t> indices;
    size_t kdtree_get_point_count() const { return indices.size(); }
    float kdtree_get_pt(size_t n, size_t dim) const {
      return points(static_cast<int64_t>(dim), indices[n]);
    }
    template <class Box>
    bool kdtree_get_bbox(Box&) const {
      return false;
    }
  };
  using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, Adaptor>,
                                                   Adaptor, 4, uint32_t>;
  Impl(const Points& points, std::vector<int32_t> indices)
      : adaptor{points, std::move(indices)}, tree(4, adaptor, {16}) {}
  Adaptor adaptor;
  Tree tree;
};

PointTree::PointTree(const Points& points, std::vector<int32_t> indices)
    : impl_(new Impl(points, std::move(indices))) {
  if (!empty()) impl_->tree.buildIndex();
}
PointTree::~PointTree() = default;
PointTree::PointTree(PointTree&&) noexcept = default;

bool PointTree::empty() const { return impl_->adaptor.indices.empty(); }

size_t PointTree::Nearest(const Eigen::Vector4f& query, std::span<int32_t> found) const {
  if (empty() || found.empty()) return 0;
  std::array<uint32_t, 64> slot;
  std::array<float, 64> distance_sq;
  const size_t wanted = std::min(found.size(), slot.size());
  const size_t count = impl_->tree.knnSearch(query.data(), wanted, slot.data(), distance_sq.data());
  for (size_t n = 0; n < count; ++n) found[n] = impl_->adaptor.indices[slot[n]];
  return count;
}

// ---- ClosestPointSearch -------------------------------------------------------------------------

ClosestPointSearch::ClosestPointSearch(const mesh::SpaceTimeMesh& mesh, const Points& points,
                                       const IndexLists& cells_around)
    : mesh_(mesh),
      points_(points),
      cells_around_(cells_around),
      tree_(points, FreeVertices(mesh, 0, points.cols())),
      flat_points_(Flatten(points)),
      first_tree_(flat_points_, FreeVertices(mesh, 0, mesh.num_first_vertices)),
      last_tree_(flat_points_,
                 FreeVertices(mesh, points.cols() - mesh.num_last_vertices, points.cols())) {}

std::optional<SurfacePoint> ClosestPointSearch::Find(const Eigen::Vector4f& p,
                                                     const Eigen::Vector4f& normal) const {
  std::array<int32_t, kNumCandidates> candidates;
  const size_t count = tree_.Nearest(p, candidates);
  for (size_t n = 0; n < count; ++n) {
    const int32_t v = candidates[n];
    if (mesh_.normals.col(v).dot(normal) <= kMinCosine) continue;
    SurfacePoint point = ProjectOnCells(v, p);
    if (point.normal.dot(normal) > kMinCosine) return point;
  }
  return std::nullopt;
}

std::optional<SurfacePoint> ClosestPointSearch::NearestVertex(const Eigen::Vector4f& p) const {
  std::array<int32_t, 1> nearest;
  if (tree_.Nearest(p, nearest) == 0) return std::nullopt;
  const int32_t v = nearest[0];
  return SurfacePoint{points_.col(v), mesh_.normals.col(v), v};
}

std::optional<SurfacePoint> ClosestPointSearch::FindAtEnd(End end, const Eigen::Vector4f& p,
                                                          const Eigen::Vector4f& normal) const {
  std::array<int32_t, kNumCandidates> candidates;
  Eigen::Vector4f flat = p;
  flat[3] = 0;
  const PointTree& tree = end == End::kFirst ? first_tree_ : last_tree_;
  const size_t count = tree.Nearest(flat, candidates);
  for (size_t n = 0; n < count; ++n) {
    const int32_t v = candidates[n];
    if (mesh_.normals.col(v).dot(normal) <= kMinCosine) continue;
    return SurfacePoint{points_.col(v), mesh_.normals.col(v), v};
  }
  return std::nullopt;
}

// Gauss-Newton over the cells' parameters, from the side of the given vertex.
SurfacePoint ClosestPointSearch::ProjectOnCells(int32_t vertex, const Eigen::Vector4f& p) const {
  SurfacePoint best{points_.col(vertex), mesh_.normals.col(vertex), vertex};
  float best_distance_sq = (p - best.position).squaredNorm();
  for (const int32_t c : cells_around_[vertex]) {
    const auto corners = CornersOf(mesh_, c);
    Eigen::Vector3f s = Eigen::Vector3f::Constant(corners.size() == 4 ? 0.25f : 0.3f);
    Eigen::Vector4f position, normal;
    for (int step = 0;; ++step) {
      const Shape shape = ShapeOf(corners.size(), s);
      Eigen::Matrix<float, 4, 3> slope = Eigen::Matrix<float, 4, 3>::Zero();
      position.setZero();
      normal.setZero();
      for (int k = 0; k < shape.num_corners; ++k) {
        const auto corner = points_.col(corners[k]);
        position += shape.weight[k] * corner;
        normal += shape.weight[k] * mesh_.normals.col(corners[k]);
        for (int a = 0; a < 3; ++a) slope.col(a) += shape.slope[k][a] * corner;
      }
      if (step == kProjectionSteps) break;
      const Eigen::Matrix3f jtj = slope.transpose() * slope + 1e-6f * Eigen::Matrix3f::Identity();
      const Eigen::Vector3f gradient = slope.transpose() * (p - position);
      s = ClampToCell(corners.size(), s + Eigen::Vector3f(jtj.inverse() * gradient));
    }
    const float distance_sq = (p - position).squaredNorm();
    const float length = normal.norm();
    if (!(distance_sq < best_distance_sq) || !(length > 0)) continue;
    best_distance_sq = distance_sq;
    best.position = position;
    best.normal = normal / length;
  }
  return best;
}

}  // namespace liquidblend::registration
