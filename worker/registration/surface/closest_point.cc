#include "worker/registration/surface/closest_point.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <limits>
#include <nanoflann.hpp>
#include <numeric>
#include <utility>

#include "absl/container/inlined_vector.h"

namespace liquidblend::registration {
namespace {

constexpr int kProjectionSteps = 3;
constexpr size_t kMostFound = 64;  // by one search
constexpr size_t kMostBoxes = 32;  // of the cells around a vertex
// Margin for rounding in comparisons of boxes with found distances.
constexpr float kBoxMargin = 1.001f;
constexpr float kBoxMarginSq = 1e-6f;  // squared edges

// Interpolation of a cell between its corners: the sum of these times 1, x, y, z, xy, xz, yz and
// xyz of its parameters, each in [0, 1].
struct Interpolant {
  Eigen::Vector4f one, x, y, z;
  Eigen::Vector4f xy = Eigen::Vector4f::Zero(), xz = xy, yz = xy, xyz = xy;

  Eigen::Vector4f At(const Eigen::Vector3f& s) const {
    return one + s.x() * x + s.y() * y + s.z() * z + s.x() * s.y() * xy + s.x() * s.z() * xz +
           s.y() * s.z() * yz + s.x() * s.y() * s.z() * xyz;
  }
  Eigen::Matrix<float, 4, 3> SlopeAt(const Eigen::Vector3f& s) const {
    Eigen::Matrix<float, 4, 3> slope;
    slope.col(0) = x + s.y() * xy + s.z() * xz + s.y() * s.z() * xyz;
    slope.col(1) = y + s.x() * xy + s.z() * yz + s.x() * s.z() * xyz;
    slope.col(2) = z + s.x() * xz + s.y() * yz + s.x() * s.y() * xyz;
    return slope;
  }
};

//   values  a column per vertex
Interpolant Interpolate(const Points& values, std::span<const int32_t> corners) {
  const auto q = [&](int k) { return values.col(corners[k]); };
  Interpolant f;
  f.one = q(0);
  f.x = q(1) - q(0);
  switch (corners.size()) {
    case 8:  // bit a of a corner's number: upper along axis a
      f.y = q(2) - q(0);
      f.z = q(4) - q(0);
      f.xy = q(3) - q(2) - f.x;
      f.xz = q(5) - q(4) - f.x;
      f.yz = q(6) - q(4) - f.y;
      f.xyz = q(7) - q(6) - q(5) + q(4) - f.xy;
      break;
    case 6:  // two triangles; x + y <= 1
      f.y = q(2) - q(0);
      f.z = q(3) - q(0);
      f.xz = q(4) - q(3) - f.x;
      f.yz = q(5) - q(3) - f.y;
      break;
    case 5:  // a quad that shrinks to the apex
      f.y = q(3) - q(0);
      f.z = q(4) - q(0);
      f.xy = q(2) - q(3) - f.x;
      f.xz = -f.x;
      f.yz = -f.y;
      f.xyz = -f.xy;
      break;
    default:
      f.y = q(2) - q(0);
      f.z = q(3) - q(0);
  }
  return f;
}

// Parameters brought back into the cell: a box, or a simplex in the first `simplex` of them.
Eigen::Vector3f ClampToCell(size_t num_corners, Eigen::Vector3f s) {
  s = s.cwiseMax(0.0f).cwiseMin(1.0f);
  const float sum = num_corners == 6 ? s.head<2>().sum() : num_corners == 4 ? s.sum() : 0.0f;
  if (sum > 1) s.head(num_corners == 6 ? 2 : 3) /= sum;
  return s;
}

struct CellPoint {
  Eigen::Vector3f parameters;
  Eigen::Vector4f position;
  float distance_sq;
};

// Gauss-Newton over the cell's parameters.
CellPoint ClosestInCell(const Points& points, std::span<const int32_t> corners,
                        const Eigen::Vector4f& p) {
  Eigen::Vector3f s = Eigen::Vector3f::Constant(corners.size() == 4 ? 0.25f : 0.3f);
  const Interpolant place = Interpolate(points, corners);
  for (int step = 0; step < kProjectionSteps; ++step) {
    const Eigen::Matrix<float, 4, 3> slope = place.SlopeAt(s);
    const Eigen::Matrix3f jtj = slope.transpose() * slope + 1e-6f * Eigen::Matrix3f::Identity();
    const Eigen::Vector3f gradient = slope.transpose() * (p - place.At(s));
    s = ClampToCell(corners.size(), s + Eigen::Vector3f(jtj.inverse() * gradient));
  }
  const Eigen::Vector4f position = place.At(s);
  return {s, position, (p - position).squaredNorm()};
}

// Squared, from the box around the corners, in which all of the cell lies; 0 within it.
float DistanceToBoxSq(const Points& points, std::span<const int32_t> corners,
                      const Eigen::Vector4f& p) {
  Eigen::Vector4f low = points.col(corners[0]), high = low;
  for (const int32_t corner : corners.subspan(1)) {
    low = low.cwiseMin(points.col(corner));
    high = high.cwiseMax(points.col(corner));
  }
  return (low - p).cwiseMax(p - high).cwiseMax(0.0f).squaredNorm();
}

}  // namespace

Points Flatten(Points points) {
  points.row(3).setZero();
  return points;
}

// ---- PointTree ----------------------------------------------------------------------------------

struct PointTree::Part {
  struct Adaptor {
    Points points;
    size_t kdtree_get_point_count() const { return static_cast<size_t>(points.cols()); }
    float kdtree_get_pt(size_t n, size_t dim) const {
      return points(static_cast<int64_t>(dim), static_cast<int64_t>(n));
    }
    template <class Box>
    bool kdtree_get_bbox(Box&) const {
      return false;
    }
  };
  // Squared, of all four coordinates at once.
  struct Distance {
    using ElementType = float;
    using DistanceType = float;
    explicit Distance(const Adaptor& from) : adaptor(from) {}
    float evalMetric(const float* query, uint32_t n, size_t) const {
      return (adaptor.points.col(n) - Eigen::Map<const Eigen::Vector4f>(query)).squaredNorm();
    }
    static float accum_dist(float a, float b, int) { return (a - b) * (a - b); }
    const Adaptor& adaptor;
  };
  using Tree = nanoflann::KDTreeSingleIndexAdaptor<Distance, Adaptor, 4, uint32_t>;

  Part(const Points& points, std::span<const int32_t> columns)
      : adaptor{points(Eigen::all, columns)},
        indices(columns.begin(), columns.end()),
        lowest(adaptor.points.rowwise().minCoeff()),
        highest(adaptor.points.rowwise().maxCoeff()),
        tree(4, adaptor, {16, nanoflann::KDTreeSingleIndexAdaptorFlags::SkipInitialBuildIndex}) {
    tree.buildIndex();
    PutInOrderOfLeaves();
  }
  void PutInOrderOfLeaves();
  // Squared, from the box around all points; 0 within it.
  float DistanceTo(const Eigen::Vector4f& p) const {
    return (lowest - p).cwiseMax(p - highest).cwiseMax(0.0f).squaredNorm();
  }

  Adaptor adaptor;
  std::vector<int32_t> indices;
  Eigen::Vector4f lowest, highest;
  Tree tree;
};

// A leaf's points lie next to one another then, which is most of what a search is about.
void PointTree::Part::PutInOrderOfLeaves() {
  adaptor.points = Points(adaptor.points(Eigen::all, tree.vAcc));
  std::vector<int32_t> ordered(indices.size());
  for (size_t n = 0; n < ordered.size(); ++n) ordered[n] = indices[tree.vAcc[n]];
  indices = std::move(ordered);
  std::iota(tree.vAcc.begin(), tree.vAcc.end(), 0);
}

namespace {

// Of several parts: columns instead of places in a part.
class NearestColumns {
 public:
  using DistanceType = float;
  explicit NearestColumns(std::span<int32_t> found) : set_(found.size()) {
    set_.init(found.data(), distance_sq_.data());
  }
  void set_indices(const std::vector<int32_t>& indices) { indices_ = &indices; }
  size_t size() const { return set_.size(); }
  bool full() const { return set_.full(); }
  float worstDist() const { return set_.worstDist(); }
  bool addPoint(float distance_sq, uint32_t n) {
    return set_.addPoint(distance_sq, (*indices_)[n]);
  }

 private:
  std::array<float, kMostFound> distance_sq_;
  nanoflann::KNNResultSet<float, int32_t> set_;
  const std::vector<int32_t>* indices_ = nullptr;
};

}  // namespace

PointTree::PointTree(const Points& points, const std::vector<int32_t>& indices,
                     const parallel::Arena& arena)
    : parts_((indices.size() + kPartPoints - 1) / kPartPoints) {
  arena.Run(static_cast<int64_t>(parts_.size()), [&](int64_t n) {
    const size_t begin = indices.size() * n / parts_.size();
    const size_t end = indices.size() * (n + 1) / parts_.size();
    parts_[n] = std::make_unique<Part>(points, std::span(indices).subspan(begin, end - begin));
  });
}
PointTree::~PointTree() = default;
PointTree::PointTree(PointTree&&) noexcept = default;

size_t PointTree::size() const {
  size_t size = 0;
  for (const std::unique_ptr<Part>& part : parts_) size += part->indices.size();
  return size;
}

size_t PointTree::Nearest(const Eigen::Vector4f& query, std::span<int32_t> found) const {
  if (empty() || found.empty()) return 0;
  NearestColumns nearest(found.first(std::min(found.size(), kMostFound)));
  const auto search = [&](const Part& part) {
    nearest.set_indices(part.indices);
    part.tree.findNeighbors(nearest, query.data(), {});
  };
  // The part that is nearest first: mostly the others are too far then.
  const Part* first = nullptr;
  float shortest = std::numeric_limits<float>::infinity();
  for (const std::unique_ptr<Part>& part : parts_) {
    const float distance = part->DistanceTo(query);
    if (first != nullptr && !(distance < shortest)) continue;
    first = part.get();
    shortest = distance;
  }
  search(*first);
  for (const std::unique_ptr<Part>& part : parts_) {
    if (part.get() != first && part->DistanceTo(query) < nearest.worstDist()) search(*part);
  }
  return nearest.size();
}

int32_t PointTree::NearestIf(const Eigen::Vector4f& query,
                             absl::FunctionRef<bool(int32_t)> accept) const {
  std::array<int32_t, kNumCandidates> found;
  for (const size_t wanted : {kFirstCandidates, kNumCandidates}) {
    const size_t count = Nearest(query, std::span(found).first(wanted));
    for (size_t n = 0; n < count; ++n) {
      if (accept(found[n])) return found[n];
    }
    if (count < wanted) break;
  }
  return -1;
}

// ---- ClosestPointSearch -------------------------------------------------------------------------

ClosestPointSearch::ClosestPointSearch(const mesh::SpaceTimeMesh& mesh, const Points& points,
                                       const PackedLists& cells_around,
                                       const parallel::Arena& arena)
    : mesh_(mesh),
      points_(points),
      cells_around_(cells_around),
      tree_(points, FreeVertices(mesh, 0, points.cols()), arena),
      first_tree_(Flatten(points), FreeVertices(mesh, 0, mesh.num_first_vertices), arena),
      last_tree_(Flatten(points),
                 FreeVertices(mesh, points.cols() - mesh.num_last_vertices, points.cols()), arena) {
}

std::optional<SurfacePoint> ClosestPointSearch::Find(const Eigen::Vector4f& p,
                                                     const Eigen::Vector4f& normal) const {
  SurfacePoint point;
  const int32_t found = tree_.NearestIf(p, [&](int32_t v) {
    if (mesh_.normals.col(v).dot(normal) <= kMinCosine) return false;
    point = ProjectOnCells(v, p);
    return point.normal.dot(normal) > kMinCosine;
  });
  if (found < 0) return std::nullopt;
  return point;
}

std::optional<SurfacePoint> ClosestPointSearch::NearestVertex(const Eigen::Vector4f& p) const {
  std::array<int32_t, 1> nearest;
  if (tree_.Nearest(p, nearest) == 0) return std::nullopt;
  const int32_t v = nearest[0];
  return SurfacePoint{points_.col(v), mesh_.normals.col(v), v};
}

std::optional<SurfacePoint> ClosestPointSearch::FindAtEnd(End end, const Eigen::Vector4f& p,
                                                          const Eigen::Vector4f& normal) const {
  Eigen::Vector4f flat = p;
  flat[3] = 0;
  const PointTree& tree = end == End::kFirst ? first_tree_ : last_tree_;
  const int32_t v = tree.NearestIf(
      flat, [&](int32_t w) { return mesh_.normals.col(w).dot(normal) > kMinCosine; });
  if (v < 0) return std::nullopt;
  return SurfacePoint{points_.col(v), mesh_.normals.col(v), v};
}

// Of the cells around a vertex that may have the point closest to p only: those in whose box around
// the corners it could be nearer than the one found in the nearest box.
SurfacePoint ClosestPointSearch::ProjectOnCells(int32_t vertex, const Eigen::Vector4f& p) const {
  absl::InlinedVector<int32_t, kMostBoxes> cells;
  for (const int32_t c : cells_around_[vertex]) cells.push_back(c);
  SurfacePoint best{points_.col(vertex), mesh_.normals.col(vertex), vertex};
  float best_distance_sq = (p - best.position).squaredNorm();
  std::array<float, kMostBoxes> box_distance_sq = {};  // of further cells 0: these are looked at
  const size_t num_boxes = std::min(cells.size(), kMostBoxes);
  size_t nearest = 0;
  for (size_t n = 0; n < num_boxes; ++n) {
    box_distance_sq[n] = DistanceToBoxSq(points_, CornersOf(mesh_, cells[n]), p);
    if (box_distance_sq[n] < box_distance_sq[nearest]) nearest = n;
  }
  std::optional<CellPoint> in_nearest;
  if (!cells.empty()) in_nearest = ClosestInCell(points_, CornersOf(mesh_, cells[nearest]), p);
  const bool has_normal =
      in_nearest && !Interpolate(mesh_.normals, CornersOf(mesh_, cells[nearest]))
                         .At(in_nearest->parameters)
                         .isZero(0);  // else it is none, and a cell further away may be the one
  const float reach_sq =
      has_normal ? std::min(best_distance_sq, in_nearest->distance_sq) : best_distance_sq;
  for (size_t n = 0; n < cells.size(); ++n) {
    if (n < num_boxes && box_distance_sq[n] > kBoxMargin * reach_sq + kBoxMarginSq) continue;
    const auto corners = CornersOf(mesh_, cells[n]);
    const CellPoint found = n == nearest ? *in_nearest : ClosestInCell(points_, corners, p);
    if (!(found.distance_sq < best_distance_sq)) continue;
    const Eigen::Vector4f normal = Interpolate(mesh_.normals, corners).At(found.parameters);
    const float length = normal.norm();
    if (!(length > 0)) continue;
    best_distance_sq = found.distance_sq;
    best.position = found.position;
    best.normal = normal / length;
  }
  return best;
}

}  // namespace liquidblend::registration
