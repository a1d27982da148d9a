#include "core/mesh/slice_at.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>

#include "core/mesh/marching_table.h"

namespace liquidblend::mesh {
namespace {

// A crossed mesh edge, by its vertices, the lower one first.
using Crossing = std::array<int32_t, 2>;

// Of each kind the cells that one slice cuts.
struct CutCells {
  std::vector<int32_t> tetrahedra, pyramids, wedges, hexahedra;
};

template <typename Cell>
void FindCutCells(const Eigen::Matrix4Xf& vertices, const std::vector<Cell>& cells,
                  std::span<const double> times, std::vector<int32_t> CutCells::*kind,
                  std::vector<CutCells>& cut) {
  for (size_t c = 0; c < cells.size(); ++c) {
    float first = std::numeric_limits<float>::infinity(), last = -first;
    for (const int32_t v : cells[c]) {
      first = std::min(first, vertices(3, v));
      last = std::max(last, vertices(3, v));
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
          corners_.push_back({std::min(cell[a], cell[b]), std::max(cell[a], cell[b])});
        }
        polygon_ends_.push_back(corners_.size());
      }
    }
  }

  // A vertex per crossed mesh edge, ascending.
  TriangleMesh Surface() const {
    std::vector<Crossing> crossings = corners_;
    std::sort(crossings.begin(), crossings.end());
    crossings.erase(std::unique(crossings.begin(), crossings.end()), crossings.end());
    TriangleMesh surface;
    surface.vertices.resize(3, static_cast<int64_t>(crossings.size()));
    for (size_t n = 0; n < crossings.size(); ++n) surface.vertices.col(n) = PointOf(crossings[n]);
    std::vector<Eigen::Vector3i> triangles;
    size_t begin = 0;
    for (const size_t end : polygon_ends_) {
      std::vector<int32_t> polygon;
      for (; begin < end; ++begin) {
        const auto at = std::lower_bound(crossings.begin(), crossings.end(), corners_[begin]);
        polygon.push_back(static_cast<int32_t>(at - crossings.begin()));
      }
      Triangulate(surface.vertices, polygon, triangles);
    }
    surface.triangles.resize(3, static_cast<int64_t>(triangles.size()));
    for (size_t n = 0; n < triangles.size(); ++n) surface.triangles.col(n) = triangles[n];
    return surface;
  }

 private:
  bool IsLater(int32_t v) const { return static_cast<double>(vertices_(3, v)) >= time_; }

  Eigen::Vector3f PointOf(const Crossing& crossing) const {
    const Eigen::Vector4d a = vertices_.col(crossing[0]).cast<double>();
    const Eigen::Vector4d b = vertices_.col(crossing[1]).cast<double>();
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
  std::vector<Crossing> corners_;     // of all polygons, one after the other
  std::vector<size_t> polygon_ends_;  // in `corners_`
};

}  // namespace

std::vector<TriangleMesh> SliceAt(const SpaceTimeMesh& mesh, std::span<const double> times,
                                  const parallel::Arena& arena) {
  return SliceAt(mesh, mesh.vertices, times, arena);
}

std::vector<TriangleMesh> SliceAt(const SpaceTimeMesh& mesh, const Eigen::Matrix4Xf& vertices,
                                  std::span<const double> times, const parallel::Arena& arena) {
  std::vector<CutCells> cut(times.size());
  FindCutCells(vertices, mesh.tetrahedra, times, &CutCells::tetrahedra, cut);
  FindCutCells(vertices, mesh.pyramids, times, &CutCells::pyramids, cut);
  FindCutCells(vertices, mesh.wedges, times, &CutCells::wedges, cut);
  FindCutCells(vertices, mesh.hexahedra, times, &CutCells::hexahedra, cut);
  std::vector<TriangleMesh> slices(times.size());
  arena.Run(static_cast<int64_t>(times.size()), [&](int64_t n) {
    Slicer slicer(vertices, times[n]);
    slicer.Cut(mesh.tetrahedra, cut[n].tetrahedra, kTetrahedronTable);
    slicer.Cut(mesh.pyramids, cut[n].pyramids, kPyramidTable);
    slicer.Cut(mesh.wedges, cut[n].wedges, kWedgeTable);
    slicer.Cut(mesh.hexahedra, cut[n].hexahedra, kHexahedronTable);
    slices[n] = slicer.Surface();
  });
  return slices;
}

}  // namespace liquidblend::mesh
