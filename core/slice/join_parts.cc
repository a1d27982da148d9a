#include "core/slice/join_parts.h"

#include <algorithm>

namespace liquidblend::slice {
namespace {

// Finds the part with the cluster: the last one that begins at or before it.
const SurfacePart& PartOf(std::span<const SurfacePart> parts, int32_t cluster) {
  const auto after = std::upper_bound(
      parts.begin(), parts.end(), cluster,
      [](int32_t number, const SurfacePart& part) { return number < part.first_cluster; });
  return after == parts.begin() ? parts.front() : *(after - 1);
}

// Finds the vertex of the whole surface; -1 if the edge's cluster has not crossed it. Bounds of
// times exclude that unless the slice was stopped.
int32_t FindVertex(std::span<const SurfacePart> parts, std::span<const ClusterVertices> clusters,
                   const OuterVertex& outer) {
  const SurfacePart& part = PartOf(parts, outer.cluster);
  const int32_t v = clusters[outer.cluster].VertexOn(outer.edge);
  if (!part.Has(v, outer.itself.near_vertex, outer.itself.far_vertex)) return -1;
  return static_cast<int32_t>(part.first_vertex) + v;
}

// Output of JoinParts(): the surface, and the ends of its vertices' edges.
struct Result {
  mesh::TriangleMesh& surface;
  std::vector<int32_t>& near_vertex;
  std::vector<int32_t>& far_vertex;

  void SetVertex(size_t v, const PartVertex& vertex) {
    std::copy_n(vertex.point.data(), 3, surface.vertices.data() + 3 * v);
    near_vertex[v] = vertex.near_vertex;
    far_vertex[v] = vertex.far_vertex;
  }
};

void CopyPart(const SurfacePart& part, Result result) {
  using Triangle = std::array<int32_t, 3>;
  for (size_t v = 0; v < part.num_vertices; ++v) {
    result.SetVertex(part.first_vertex + v, part.vertices[v]);
  }
  auto* const triangles = reinterpret_cast<Triangle*>(result.surface.triangles.data());
  if (part.first_vertex == 0 && part.outer.empty()) {
    std::copy_n(part.triangles.begin(), part.num_triangles, triangles);
    return;
  }
  const auto first = static_cast<int32_t>(part.first_vertex);
  const auto vertex_of = [&](int32_t v) { return v >= 0 ? first + v : part.outer[-1 - v].vertex; };
  for (size_t t = 0; t < part.num_triangles; ++t) {
    const Triangle& triangle = part.triangles[t];
    triangles[part.first_triangle + t] = {vertex_of(triangle[0]), vertex_of(triangle[1]),
                                          vertex_of(triangle[2])};
  }
}

}  // namespace

mesh::TriangleMesh JoinParts(std::span<SurfacePart> parts,
                             std::span<const ClusterVertices> clusters,
                             absl::FunctionRef<void(absl::FunctionRef<void(int)>)> for_each,
                             std::vector<int32_t>& near_vertex, std::vector<int32_t>& far_vertex) {
  size_t num_vertices = 0;
  size_t num_triangles = 0;
  for (SurfacePart& part : parts) {
    part.first_vertex = num_vertices;
    part.first_triangle = num_triangles;
    num_vertices += part.num_vertices;
    num_triangles += part.num_triangles;
  }
  std::vector<const OuterVertex*> left_over;
  for (SurfacePart& part : parts) {
    for (OuterVertex& outer : part.outer) {
      outer.vertex = FindVertex(parts, clusters, outer);
      if (outer.vertex >= 0) continue;
      outer.vertex = static_cast<int32_t>(num_vertices + left_over.size());
      left_over.push_back(&outer);
    }
  }
  mesh::TriangleMesh surface;
  surface.vertices.resize(3, static_cast<Eigen::Index>(num_vertices + left_over.size()));
  surface.triangles.resize(3, static_cast<Eigen::Index>(num_triangles));
  near_vertex.resize(num_vertices + left_over.size());
  far_vertex.resize(near_vertex.size());
  Result result{surface, near_vertex, far_vertex};
  for_each([&](int p) { CopyPart(parts[p], result); });
  for (size_t i = 0; i < left_over.size(); ++i) {
    result.SetVertex(num_vertices + i, left_over[i]->itself);
  }
  return surface;
}

}  // namespace liquidblend::slice
