#include "worker/registration/features/parts.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "core/mesh/cross_product.h"
#include "core/mesh/union_find.h"

namespace liquidblend::registration {
namespace {

int SlabOf(const Surface& surface, int32_t v) {
  return static_cast<int>(std::floor(surface.points(3, v))) + 1;
}

// The cell's volume times its normal: a hexahedron and a wedge by their mean edges.
Eigen::Vector4d AreaVector(const Surface& surface, std::span<const int32_t> corners) {
  const auto p = [&](int k) -> Eigen::Vector4f { return surface.points.col(corners[k]); };
  Eigen::Matrix<float, 4, 3> edges;
  float share = 1.0f;
  switch (corners.size()) {
    case 8:
      edges << p(1) + p(3) + p(5) + p(7) - p(0) - p(2) - p(4) - p(6),
          p(2) + p(3) + p(6) + p(7) - p(0) - p(1) - p(4) - p(5),
          p(4) + p(5) + p(6) + p(7) - p(0) - p(1) - p(2) - p(3);
      share = 1.0f / 64;
      break;
    case 6:
      edges << p(1) + p(4) - p(0) - p(3), p(2) + p(5) - p(0) - p(3),
          p(3) + p(4) + p(5) - p(0) - p(1) - p(2);
      share = 1.0f / 24;
      break;
    case 5:
      edges << p(1) - p(0), p(3) - p(0), p(4) - p(0);
      share = 1.0f / 3;
      break;
    default:
      edges << p(1) - p(0), p(2) - p(0), p(3) - p(0);
      share = 1.0f / 6;
  }
  return (share * mesh::CrossProduct(edges)).cast<double>();
}

struct Builder {
  const Surface& surface;
  std::vector<int32_t> slab;  // per vertex
  PartGraph graph = {};
  std::vector<int32_t>& part_of = graph.part_of;

  void NumberParts();
  void MeasureVertices();
  void MeasureCells();
};

// Vertices of one slab that share a cell are connected.
void Builder::NumberParts() {
  const int64_t count = surface.points.cols();
  mesh::UnionFind sets(count);
  for (int64_t c = 0; c < surface.mesh.num_cells(); ++c) {
    const auto corners = CornersOf(surface.mesh, c);
    for (size_t i = 1; i < corners.size(); ++i) {
      for (size_t j = 0; j < i; ++j) {
        if (slab[corners[i]] != slab[corners[j]]) continue;
        sets.Join(corners[i], corners[j]);
        break;
      }
    }
  }
  std::vector<int32_t> roots;
  for (int32_t v = 0; v < count; ++v) {
    if (!surface.rigid[v] && sets.Root(v) == v) roots.push_back(v);
  }
  std::stable_sort(roots.begin(), roots.end(),
                   [&](int32_t a, int32_t b) { return slab[a] < slab[b]; });
  part_of.assign(count, -1);
  for (size_t n = 0; n < roots.size(); ++n) {
    part_of[roots[n]] = static_cast<int32_t>(n);
    graph.parts.push_back({.slab = slab[roots[n]], .number = static_cast<int32_t>(n)});
  }
  for (int32_t v = 0; v < count; ++v) {
    if (!surface.rigid[v]) part_of[v] = part_of[sets.Root(v)];
  }
}

void Builder::MeasureVertices() {
  for (int32_t v = 0; v < surface.points.cols(); ++v) {
    if (part_of[v] < 0) continue;
    Part& part = graph.parts[part_of[v]];
    part.centre += surface.points.col(v).cast<double>();
    ++part.num_vertices;
  }
  for (Part& part : graph.parts) part.centre /= static_cast<double>(part.num_vertices);
  for (int32_t v = 0; v < surface.points.cols(); ++v) {
    if (part_of[v] < 0) continue;
    Part& part = graph.parts[part_of[v]];
    const Eigen::Vector3d offset =
        surface.points.col(v).head<3>().cast<double>() - part.centre.head<3>();
    for (size_t k = 0; k < kReachDirections.size(); ++k) {
      const auto& d = kReachDirections[k];
      part.reach[k] = std::max(part.reach[k], offset.dot(Eigen::Vector3d(d[0], d[1], d[2])));
    }
  }
}

// A cell belongs to the part of its earliest corner, so each part has the cells of about one frame;
// the divergence theorem makes the part's volume of them.
void Builder::MeasureCells() {
  for (int64_t c = 0; c < surface.mesh.num_cells(); ++c) {
    const auto corners = CornersOf(surface.mesh, c);
    if (surface.rigid[corners[0]]) continue;
    const int32_t first = *std::min_element(
        corners.begin(), corners.end(), [&](int32_t a, int32_t b) { return slab[a] < slab[b]; });
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const int32_t v : corners) middle += surface.points.col(v).head<3>().cast<double>();
    middle /= static_cast<double>(corners.size());
    Part& part = graph.parts[part_of[first]];
    const Eigen::Vector3d offset = middle - part.centre.head<3>();
    part.volume += AreaVector(surface, corners).head<3>().dot(offset) / 3;
    for (const int32_t v : corners) {
      const PartLink link = {part_of[first], part_of[v]};
      if (slab[v] > slab[first] && (graph.links.empty() || graph.links.back() != link)) {
        graph.links.push_back(link);
      }
    }
  }
  std::sort(graph.links.begin(), graph.links.end());
  graph.links.erase(std::unique(graph.links.begin(), graph.links.end()), graph.links.end());
}

}  // namespace

PartGraph FindParts(const Surface& surface) {
  Builder builder{surface, std::vector<int32_t>(surface.points.cols())};
  for (int32_t v = 0; v < surface.points.cols(); ++v) builder.slab[v] = SlabOf(surface, v);
  builder.NumberParts();
  builder.MeasureVertices();
  builder.MeasureCells();
  return std::move(builder.graph);
}

}  // namespace liquidblend::registration
