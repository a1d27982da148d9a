// Cuts vertices off a triangle surface, and closes the holes. Internal to worker/registration.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "core/mesh/triangle_mesh.h"

namespace liquidblend::registration {

// A closed surface, from which vertices are cut off with their triangles. It must outlive this.
// Threads: one at a time.
class CutSurface {
 public:
  explicit CutSurface(const mesh::TriangleMesh& surface)
      : surface_(surface), is_cut_(static_cast<size_t>(surface.num_vertices()), 0) {}

  void Cut(int64_t vertex) { is_cut_[vertex] = 1; }

  // Cuts off what hangs on the rim by one vertex, and of each component all pieces but the largest.
  // Then closes each hole with a fan of triangles, around a vertex in its middle. Velocities are
  // kept. Nothing if all is cut off, or the rims do not become clean.
  // Cost: O(n log n) in the triangles that are cut off, O(n) in the others, a few times.
  std::optional<mesh::TriangleMesh> Close();

 private:
  bool IsKept(Eigen::Index triangle) const;
  std::multimap<int32_t, int32_t> RimEdges() const;
  bool CutPinched();
  bool CutIslands();
  std::vector<std::vector<int32_t>> Rims() const;

  const mesh::TriangleMesh& surface_;
  std::vector<char> is_cut_;  // per vertex
};

}  // namespace liquidblend::registration
