#include "worker/spacetime/time_extrema.h"

#include <algorithm>
#include <limits>
#include <vector>

namespace liquidblend::spacetime {
namespace {

constexpr int kNumPasses = 3;
constexpr double kLayerMargin = 0.05;  // of a step, from the layers

struct Around {
  float earliest = std::numeric_limits<float>::infinity();
  float latest = -std::numeric_limits<float>::infinity();
  float sum = 0.0F;
  int count = 0;
};

// Finds the times of the neighbours of flagged vertices. A neighbour counts once for each
// hexahedron with both.
void FindTimesAround(const mesh::SpaceTimeMesh& mesh, const std::vector<char>& flags,
                     std::vector<Around>& around) {
  around.assign(mesh.num_vertices(), {});
  for (const mesh::Hexahedron& cell : mesh.hexahedra) {
    for (int c = 0; c < 8; ++c) {
      if (flags[cell[c]] == 0) continue;
      Around& a = around[cell[c]];
      for (const int axis : {1, 2, 4}) {
        if (cell[c ^ axis] == cell[c]) continue;
        const float time = mesh.vertices(3, cell[c ^ axis]);
        a.earliest = std::min(a.earliest, time);
        a.latest = std::max(a.latest, time);
        a.sum += time;
        ++a.count;
      }
    }
  }
}

// Moves vertices that are earlier or later than all of their neighbours in `around`; returns them.
std::vector<int64_t> FlattenOnce(const Layers& layers, const std::vector<int64_t>& first_vertex,
                                 const std::vector<Around>& around, mesh::SpaceTimeMesh& mesh) {
  std::vector<int64_t> moved;
  for (size_t s = 1; s + 1 < layers.slabs.size(); ++s) {
    const Slab& slab = layers.slabs[s];
    const double begin = layers.begin(s);
    const double step = (layers.end(s) - begin) / slab.steps.num_steps();
    for (const Slab::Cell& cell : slab.cells) {
      for (int sheet = 0; sheet < cell.num_sheets; ++sheet) {
        const int64_t v = first_vertex[s] + cell.first_vertex + sheet;
        const Around& a = around[v];
        float& time = mesh.vertices(3, v);
        if (a.count == 0 || (time >= a.earliest && time <= a.latest)) continue;
        const auto earliest = static_cast<float>(begin + step * (cell.begin_layer + kLayerMargin));
        const auto latest = static_cast<float>(begin + step * (cell.end_layer - kLayerMargin));
        time = std::clamp(a.sum / static_cast<float>(a.count), earliest, latest);
        moved.push_back(v);
      }
    }
  }
  return moved;
}

// Flags the vertices that share a hexahedron with a moved vertex.
std::vector<char> FlagNeighbors(const mesh::SpaceTimeMesh& mesh,
                                const std::vector<int64_t>& moved) {
  std::vector<char> is_moved(mesh.num_vertices(), 0), flags(mesh.num_vertices(), 0);
  for (const int64_t v : moved) is_moved[v] = 1;
  for (const mesh::Hexahedron& cell : mesh.hexahedra) {
    if (std::none_of(cell.begin(), cell.end(), [&](int32_t v) { return is_moved[v] != 0; })) {
      continue;
    }
    for (const int32_t v : cell) flags[v] = 1;
  }
  return flags;
}

}  // namespace

void FlattenTimeExtrema(const Layers& layers, const std::vector<int64_t>& first_vertex,
                        mesh::SpaceTimeMesh& mesh) {
  std::vector<char> flags(mesh.num_vertices(), 1);
  std::vector<Around> around;
  for (int pass = 0; pass < kNumPasses; ++pass) {
    FindTimesAround(mesh, flags, around);
    const std::vector<int64_t> moved = FlattenOnce(layers, first_vertex, around, mesh);
    if (moved.empty()) return;
    if (pass + 1 < kNumPasses) flags = FlagNeighbors(mesh, moved);
  }
}

}  // namespace liquidblend::spacetime
