#include "core/mesh/slice_at.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "core/mesh/marching_table.h"

namespace liquidblend::mesh {
namespace {

constexpr size_t kBatch = 64;  // slices whose cells are found at once: bounds the memory

// Cells that one slice cuts, by kind.
struct CutCells {
  std::vector<int32_t> tetrahedra, pyramids, wedges, hexahedra;
};

//   vertex_times  of the mesh's vertices
// Finds the cells of one kind that each slice cuts.
template <typename Cell>
void FindCutCells(const Eigen::VectorXf& vertex_times, const std::vector<Cell>& cells,
                  std::span<const double> times, std::vector<int32_t> CutCells::*kind,
                  std::vector<CutCells>& cut) {
  for (size_t c = 0; c < cells.size(); ++c) {
    float first = std::numeric_limits<float>::infinity(), last = -first;
    for (const int32_t v : cells[c]) {
      first = std::min(first, vertex_times[v]);
      last = std::max(last, vertex_times[v]);
    }
    // Corners at the time itself count as later.
    const auto begin = std::upper_bound(times.begin(), times.end(), static_cast<double>(first));
    for (auto t = begin; t != times.end() && *t <= last; ++t) {
      (cut[t - times.begin()].*kind).push_back(static_cast<int32_t>(c));
    }
  }
}

// Collects the polygons in which one hyperplane cuts cells.
class Slicer {
 public:
  Slicer(const Eigen::Matrix4Xf& vertices, double time) : vertices_(vertices), time_(time) {}

  template <typename Cell, int kCorners>
  void Cut(const std::vector<Cell>& cells, const std::vector<int32_t>& cut,
           const MarchingTable<kCorners>& table) {
    static_assert(std::tuple_size_v<Cell> == kCorners);
    for (const int32_t c : cut) {
      const Cell& cell = cells[c];
      unsigned code = 0;
      for (int k = 0; k < kCorners; ++k) code |= (IsLater(cell[k]) ? 1u : 0u) << k;
      const Case& found = table.cases[code];
      const int8_t* edge = found.edges.data();
      for (int loop = 0; loop < found.num_loops; ++loop) {
        for (int k = 0; k < found.loop_size[loop]; ++k, ++edge) {
          const auto [a, b] = table.edges[*edge];
          polygons_.push_back(VertexOn(cell[a], cell[b]));
        }
        polygon_ends_.push_back(polygons_.size());
      }
    }
  }

  TracedSlice Finish() && {
    TriangleMesh surface;
    surface.vertices.resize(3, static_cast<int64_t>(edges_.size()));
    for (size_t n = 0; n < edges_.size(); ++n) surface.vertices.col(n) = PointOn(edges_[n]);
    std::vector<Eigen::Vector3i> triangles;
    std::vector<int32_t> polygon;
    size_t begin = 0;
    for (const size_t end : polygon_ends_) {
      polygon.assign(polygons_.begin() + begin, polygons_.begin() + end);
      Triangulate(surface.vertices, polygon, triangles);
      begin = end;
    }
    surface.triangles.resize(3, static_cast<int64_t>(triangles.size()));
    for (size_t n = 0; n < triangles.size(); ++n) surface.triangles.col(n) = triangles[n];
    return {std::move(surface), std::move(edges_)};
  }

 private:
  bool IsLater(int32_t v) const { return static_cast<double>(vertices_(3, v)) >= time_; }

  // The slice's vertex on a mesh edge; they are numbered as they come.
  int32_t VertexOn(int32_t a, int32_t b) {
    const std::array<int32_t, 2> edge = {std::min(a, b), std::max(a, b)};
    const uint64_t key = static_cast<uint64_t>(edge[0]) << 32 | static_cast<uint32_t>(edge[1]);
    const auto [found, is_new] = numbers_.try_emplace(key, static_cast<int32_t>(edges_.size()));
    if (is_new) edges_.push_back(edge);
    return found->second;
  }

  Eigen::Vector3f PointOn(const std::array<int32_t, 2>& edge) const {
    const Eigen::Vector4d a = vertices_.col(edge[0]).cast<double>();
    const Eigen::Vector4d b = vertices_.col(edge[1]).cast<double>();
    const double s = (time_ - a.w()) / (b.w() - a.w());
    return ((1 - s) * a + s * b).head<3>().cast<float>();
  }

  // Cuts off the ear with the shortest base until a triangle is left.
  static void Triangulate(const Eigen::Matrix3Xf& points, std::vector<int32_t>& polygon,
                          std::vector<Eigen::Vector3i>& triangles) {
    const auto add = [&](int32_t a, int32_t b, int32_t c) {
      if (a != b && b != c && c != a) triangles.emplace_back(a, b, c);
    };
    while (polygon.size() > 3) {
      const size_t size = polygon.size();
      size_t best = 0;
      float best_base_sq = std::numeric_limits<float>::infinity();
      for (size_t k = 0; k < size; ++k) {
        const float base_sq =
            (points.col(polygon[(k + size - 1) % size]) - points.col(polygon[(k + 1) % size]))
                .squaredNorm();
        if (base_sq >= best_base_sq) continue;
        best = k;
        best_base_sq = base_sq;
      }
      add(polygon[(best + size - 1) % size], polygon[best], polygon[(best + 1) % size]);
      polygon.erase(polygon.begin() + static_cast<int64_t>(best));
    }
    add(polygon[0], polygon[1], polygon[2]);
  }

  const Eigen::Matrix4Xf& vertices_;
  const double time_;
  std::vector<std::array<int32_t, 2>> edges_;       // per vertex of the slice
  absl::flat_hash_map<uint64_t, int32_t> numbers_;  // of edges_; never walked through
  std::vector<int32_t> polygons_;     // vertices of the slice, one polygon after the other
  std::vector<size_t> polygon_ends_;  // in `polygons_`
};

// The slices at a few times; the same contract as VisitSlices().
void VisitBatch(const SpaceTimeMesh& mesh, const Eigen::Matrix4Xf& vertices,
                std::span<const double> times, const parallel::Arena& arena,
                const std::function<void(int64_t, TracedSlice)>& visit) {
  const Eigen::VectorXf vertex_times = vertices.row(3);
  std::vector<CutCells> cut(times.size());
  FindCutCells(vertex_times, mesh.tetrahedra, times, &CutCells::tetrahedra, cut);
  FindCutCells(vertex_times, mesh.pyramids, times, &CutCells::pyramids, cut);
  FindCutCells(vertex_times, mesh.wedges, times, &CutCells::wedges, cut);
  FindCutCells(vertex_times, mesh.hexahedra, times, &CutCells::hexahedra, cut);
  arena.Run(static_cast<int64_t>(times.size()), [&](int64_t n) {
    Slicer slicer(vertices, times[n]);
    slicer.Cut(mesh.tetrahedra, cut[n].tetrahedra, kTetrahedronTable);
    slicer.Cut(mesh.pyramids, cut[n].pyramids, kPyramidTable);
    slicer.Cut(mesh.wedges, cut[n].wedges, kWedgeTable);
    slicer.Cut(mesh.hexahedra, cut[n].hexahedra, kHexahedronTable);
    visit(n, std::move(slicer).Finish());
  });
}

}  // namespace

std::vector<TriangleMesh> SliceAt(const SpaceTimeMesh& mesh, std::span<const double> times,
                                  const parallel::Arena& arena) {
  return SliceAt(mesh, mesh.vertices, times, arena);
}

std::vector<TriangleMesh> SliceAt(const SpaceTimeMesh& mesh, const Eigen::Matrix4Xf& vertices,
                                  std::span<const double> times, const parallel::Arena& arena) {
  std::vector<TriangleMesh> slices(times.size());
  VisitSlices(mesh, vertices, times, arena,
              [&](int64_t n, TracedSlice slice) { slices[n] = std::move(slice.surface); });
  return slices;
}

void VisitSlices(const SpaceTimeMesh& mesh, const Eigen::Matrix4Xf& vertices,
                 std::span<const double> times, const parallel::Arena& arena,
                 const std::function<void(int64_t, TracedSlice)>& visit) {
  for (size_t begin = 0; begin < times.size(); begin += kBatch) {
    const size_t count = std::min(kBatch, times.size() - begin);
    VisitBatch(mesh, vertices, times.subspan(begin, count), arena,
               [&](int64_t n, TracedSlice slice) {
                 visit(static_cast<int64_t>(begin) + n, std::move(slice));
               });
  }
}

}  // namespace liquidblend::mesh
