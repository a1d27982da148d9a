// A space-time mesh's cells around each vertex, and its vertices as a graph. Internal to
// worker/registration.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "core/mesh/space_time_mesh.h"
#include "core/parallel/arena.h"
#include "worker/registration/surface/packed_lists.h"

namespace liquidblend::registration {

// Vertices of a mesh in registration units: x, y, z in mean edge lengths, t in frames.
using Points = Eigen::Matrix4Xf;

// Lists of indices, one per row.
struct IndexLists {
  std::vector<int64_t> begin = {0};  // num_rows + 1
  std::vector<int32_t> items;
  int64_t num_rows() const { return static_cast<int64_t>(begin.size()) - 1; }
  std::span<const int32_t> operator[](int64_t row) const {
    return {items.data() + begin[row], static_cast<size_t>(begin[row + 1] - begin[row])};
  }
};

// Corners of cell c, all kinds numbered through: hexahedra, wedges, pyramids, tetrahedra.
std::span<const int32_t> CornersOf(const mesh::SpaceTimeMesh& mesh, int64_t c);

// The cells around each vertex, ascending; twice where a flat cell has the vertex twice.
// Threads: same bytes for any thread count.
PackedLists CellsAroundVertices(const mesh::SpaceTimeMesh& mesh, const parallel::Arena& arena);

// The neighbours of each vertex: all that share a cell with it, ascending (about 26). The six axis
// neighbours alone would measure Manhattan distances.
// Threads: same bytes for any thread count.
PackedLists VertexNeighbors(const mesh::SpaceTimeMesh& mesh, const PackedLists& cells_around,
                            const parallel::Arena& arena);

// Positions in registration units, with the unit of length given.
Points InEdgeUnits(const Eigen::Matrix4Xf& vertices, double edge_length_m);

// The vertices of [begin, end) outside of rigid pieces, ascending.
std::vector<int32_t> FreeVertices(const mesh::SpaceTimeMesh& mesh, int64_t begin, int64_t end);

// Geodesic distances along the graph's edges from one vertex, out to a radius (Dijkstra's, with
// buckets instead of a heap: a vertex may be visited again, the distances are the same). Keeps its
// scratch between calls. Threads: one at a time.
class GeodesicSearch {
 public:
  struct Reached {
    int32_t vertex;
    float distance;
  };
  GeodesicSearch(const Points& points, const PackedLists& neighbors);
  // The vertices closer than `radius`, `from` first, the others in a fixed order.
  const std::vector<Reached>& From(int32_t from, float radius);

 private:
  void Visit(const Reached& nearest, float radius);

  const Points& points_;
  const PackedLists& neighbors_;
  std::vector<float> distance_;  // of the vertices reached in this call, else infinity
  std::vector<std::vector<Reached>> buckets_;  // by distance
  std::vector<Reached> reached_;
};

}  // namespace liquidblend::registration
