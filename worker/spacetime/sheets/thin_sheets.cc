#include "worker/spacetime/sheets/thin_sheets.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "worker/spacetime/field/point_grid.h"

namespace liquidblend::spacetime {
namespace {

constexpr float kMaxOpposedCosine = -0.3f;  // cosine between normals
constexpr double kMinOpposedShare = 0.1;
constexpr int kRings = 2;

// The free vertices of each frame of time that has some, ascending. What lies before or after all
// frames counts as one frame each.
std::vector<std::vector<int32_t>> VerticesByFrame(const mesh::SpaceTimeMesh& mesh) {
  const std::vector<char> rigid = mesh::RigidVertices(mesh);
  std::map<float, std::vector<int32_t>> by_frame;
  auto last = by_frame.end();  // vertices come by slabs
  for (int32_t v = 0; v < mesh.num_vertices(); ++v) {
    if (rigid[v]) continue;
    const float frame =
        std::clamp(std::floor(mesh.vertices(3, v)), -1.0F - static_cast<float>(mesh.num_pre_roll),
                   static_cast<float>(mesh.num_frames));
    if (last == by_frame.end() || last->first != frame) last = by_frame.try_emplace(frame).first;
    last->second.push_back(v);
  }
  std::vector<std::vector<int32_t>> lists;
  for (auto& [frame, vertices] : by_frame) lists.push_back(std::move(vertices));
  return lists;
}

// The two sides of a sheet look away from each other. Normals have unit length.
bool AreOpposed(const Eigen::Vector3f& p, const Eigen::Vector3f& n, const Eigen::Vector3f& other_p,
                const Eigen::Vector3f& other_n) {
  return n.dot(other_n) < kMaxOpposedCosine && (other_p - p).dot(n) < 0;
}

// Holds normals, to tell at once that none of them is opposed to another one.
struct NormalBox {
  Eigen::Array3f lo = Eigen::Array3f::Constant(2), hi = Eigen::Array3f::Constant(-2);

  void Add(const NormalBox& other) {
    lo = lo.min(other.lo);
    hi = hi.max(other.hi);
  }
  float LeastDot(const Eigen::Vector3f& n) const {
    return (n.array() * lo).min(n.array() * hi).sum();
  }
};

// Of the normals in each bucket of the grid.
std::vector<NormalBox> BoxesOf(const PointGrid& grid, const Eigen::Matrix3Xf& points,
                               const Eigen::Matrix3Xf& normals) {
  std::vector<NormalBox> boxes(grid.num_buckets());
  for (int64_t n = 0; n < points.cols(); ++n) {
    const Eigen::Array3f normal = normals.col(n);
    boxes[grid.BucketOf(grid.CubeOf(points.col(n)))].Add({normal, normal});
  }
  return boxes;
}

void FlagFrame(const std::vector<int32_t>& vertices, float thickness_m, mesh::SpaceTimeMesh& mesh) {
  const auto count = static_cast<int64_t>(vertices.size());
  Eigen::Matrix3Xf points(3, count), normals(3, count);
  for (int64_t n = 0; n < count; ++n) {
    points.col(n) = mesh.vertices.col(vertices[n]).head<3>();
    normals.col(n) = mesh.normals.col(vertices[n]).head<3>().stableNormalized();
  }
  const PointGrid grid(points, thickness_m);
  const std::vector<NormalBox> boxes = BoxesOf(grid, points, normals);
  std::optional<PointCube> cube;
  NormalBox around;  // of the cube
  grid.ForEach([&](int32_t n) {
    const Eigen::Vector3f p = points.col(n), normal = normals.col(n);
    if (const PointCube own = grid.CubeOf(p); own != cube) {
      cube = own;
      around = {};
      grid.ForEachBucket(own, [&](size_t bucket, const PointCube&) { around.Add(boxes[bucket]); });
    }
    if (around.LeastDot(normal) >= kMaxOpposedCosine) return;
    int num_near = 0, num_opposed = 0;
    grid.ForEachNear(
        p, [&](size_t bucket) { return boxes[bucket].LeastDot(normal) < kMaxOpposedCosine; },
        [&](int32_t other) {
          if (AreOpposed(p, normal, points.col(other), normals.col(other))) ++num_opposed;
        });
    if (num_opposed == 0) return;
    grid.ForEachNear(p, [&](int32_t) { ++num_near; });
    if (num_opposed > kMinOpposedShare * num_near) mesh.thin[vertices[n]] = 1;
  });
}

// All corners of cells that have a flagged one.
template <typename Cell>
void FlagAround(const std::vector<Cell>& cells, const std::vector<char>& before,
                std::vector<char>& flags) {
  for (const Cell& cell : cells) {
    if (std::none_of(cell.begin(), cell.end(), [&](int32_t v) { return before[v] != 0; })) continue;
    for (const int32_t v : cell) flags[v] = 1;
  }
}

}  // namespace

void FlagThinSheets(double thickness_m, const parallel::Arena& arena, mesh::SpaceTimeMesh& mesh) {
  mesh.thin.assign(mesh.num_vertices(), 0);
  const auto by_frame = VerticesByFrame(mesh);
  arena.Run(static_cast<int64_t>(by_frame.size()),
            [&](int64_t f) { FlagFrame(by_frame[f], static_cast<float>(thickness_m), mesh); });
  for (int ring = 0; ring < kRings; ++ring) {
    const std::vector<char> before = mesh.thin;
    FlagAround(mesh.hexahedra, before, mesh.thin);
    FlagAround(mesh.wedges, before, mesh.thin);
    FlagAround(mesh.pyramids, before, mesh.thin);
    FlagAround(mesh.tetrahedra, before, mesh.thin);
  }
}

}  // namespace liquidblend::spacetime
