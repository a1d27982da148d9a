#include "worker/registration/surface/cell_graph.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/base/prefetch.h"

namespace liquidblend::registration {
namespace {

constexpr float kBucketWidth = 0.5f;   // edges; about half of those between neighbours
constexpr size_t kPrefetchVisits = 4;  // visits

}  // namespace

std::span<const int32_t> CornersOf(const mesh::SpaceTimeMesh& mesh, int64_t c) {
  const auto num = [](const auto& cells) { return static_cast<int64_t>(cells.size()); };
  if (c < num(mesh.hexahedra)) return mesh.hexahedra[c];
  c -= num(mesh.hexahedra);
  if (c < num(mesh.wedges)) return mesh.wedges[c];
  c -= num(mesh.wedges);
  if (c < num(mesh.pyramids)) return mesh.pyramids[c];
  return mesh.tetrahedra[c - num(mesh.pyramids)];
}

PackedLists CellsAroundVertices(const mesh::SpaceTimeMesh& mesh, const parallel::Arena& arena) {
  std::vector<int64_t> begin(mesh.num_vertices() + 1, 0);
  const int64_t num_cells = mesh.num_cells();
  for (int64_t c = 0; c < num_cells; ++c) {
    for (const int32_t v : CornersOf(mesh, c)) ++begin[v + 1];
  }
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<int32_t> cells(begin.back());
  std::vector<int64_t> next(begin.begin(), begin.end() - 1);
  for (int64_t c = 0; c < num_cells; ++c) {
    for (const int32_t v : CornersOf(mesh, c)) cells[next[v]++] = static_cast<int32_t>(c);
  }
  return PackedLists(mesh.num_vertices(), arena, [&](int64_t v, std::vector<int32_t>& around) {
    around.assign(cells.begin() + begin[v], cells.begin() + begin[v + 1]);
  });
}

PackedLists VertexNeighbors(const mesh::SpaceTimeMesh& mesh, const PackedLists& cells_around,
                            const parallel::Arena& arena) {
  return PackedLists(mesh.num_vertices(), arena, [&](int64_t v, std::vector<int32_t>& around) {
    for (const int32_t c : cells_around[v]) {
      const auto corners = CornersOf(mesh, c);
      around.insert(around.end(), corners.begin(), corners.end());
    }
    std::sort(around.begin(), around.end());
    around.erase(std::unique(around.begin(), around.end()), around.end());
    std::erase(around, static_cast<int32_t>(v));
  });
}

Points InEdgeUnits(const Eigen::Matrix4Xf& vertices, double edge_length_m) {
  Points points = vertices;
  points.topRows<3>() /= static_cast<float>(edge_length_m);
  return points;
}

std::vector<int32_t> FreeVertices(const mesh::SpaceTimeMesh& mesh, int64_t begin, int64_t end) {
  const std::vector<char> rigid = mesh::RigidVertices(mesh);
  std::vector<int32_t> indices;
  for (int64_t v = begin; v < end; ++v) {
    if (!rigid[v]) indices.push_back(static_cast<int32_t>(v));
  }
  return indices;
}

GeodesicSearch::GeodesicSearch(const Points& points, const PackedLists& neighbors)
    : points_(points),
      neighbors_(neighbors),
      distance_(points.cols(), std::numeric_limits<float>::infinity()) {}

const std::vector<GeodesicSearch::Reached>& GeodesicSearch::From(int32_t from, float radius) {
  for (const Reached& reached : reached_) {
    distance_[reached.vertex] = std::numeric_limits<float>::infinity();
  }
  buckets_.resize(1 + static_cast<size_t>(radius / kBucketWidth));
  reached_.assign(1, {from, 0.0f});
  distance_[from] = 0.0f;
  buckets_[0].assign(1, {from, 0.0f});
  for (std::vector<Reached>& bucket : buckets_) {
    for (size_t n = 0; n < bucket.size(); ++n) {  // it may grow
      const Reached nearest = bucket[n];
      if (n + kPrefetchVisits < bucket.size()) {
        // All lists take more room than the second cache has; one of about 26 takes a line.
        base::PrefetchIntoL2(neighbors_.bytes(bucket[n + kPrefetchVisits].vertex));
      }
      if (nearest.distance == distance_[nearest.vertex]) Visit(nearest, radius);
    }
    bucket.clear();
  }
  for (Reached& reached : reached_) reached.distance = distance_[reached.vertex];
  return reached_;
}

void GeodesicSearch::Visit(const Reached& nearest, float radius) {
  const Eigen::Vector4f position = points_.col(nearest.vertex);
  for (const int32_t w : neighbors_[nearest.vertex]) {
    // One test that seldom passes is faster than several that often do.
    const float room = std::min(distance_[w], radius) - nearest.distance;
    const float length_sq = (points_.col(w) - position).squaredNorm();
    if (!(room > 0) | !(length_sq < room * room)) continue;
    const float distance = nearest.distance + std::sqrt(length_sq);
    if (distance >= radius || distance >= distance_[w]) continue;
    if (distance_[w] == std::numeric_limits<float>::infinity()) reached_.push_back({w, 0.0f});
    distance_[w] = distance;
    buckets_[static_cast<size_t>(distance / kBucketWidth)].push_back({w, distance});
  }
}

}  // namespace liquidblend::registration
