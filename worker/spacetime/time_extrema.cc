#include "worker/spacetime/time_extrema.h"

#include <algorithm>
#include <limits>

namespace liquidblend::spacetime {
namespace {

constexpr int kNumPasses = 3;
constexpr double kMargin = 0.05;  // of a step, from the layers

struct Around {
  float earliest = std::numeric_limits<float>::infinity();
  float latest = -std::numeric_limits<float>::infinity();
  float sum = 0.0F;
  int count = 0;
};

// The times of each vertex' neighbours, as often as hexahedra join them.
std::vector<Around> TimesAround(const mesh::SpaceTimeMesh& mesh) {
  std::vector<Around> around(mesh.num_vertices());
  for (const mesh::Hexahedron& cell : mesh.hexahedra) {
    for (int c = 0; c < 8; ++c) {
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
  return around;
}

// Returns how many moved.
int64_t FlattenOnce(const Layers& layers, const std::vector<int64_t>& first_vertex,
                    mesh::SpaceTimeMesh& mesh) {
  const std::vector<Around> around = TimesAround(mesh);
  int64_t num_moved = 0;
  for (size_t s = 1; s + 1 < layers.slabs.size(); ++s) {
    const Slab& slab = layers.slabs[s];
    const double begin = layers.begin(s);
    const double step = (layers.end(s) - begin) / slab.steps.num_steps();
    for (const Slab::Cell& cell : slab.cells) {
      const auto earliest = static_cast<float>(begin + step * (cell.begin_layer + kMargin));
      const auto latest = static_cast<float>(begin + step * (cell.end_layer - kMargin));
      for (int sheet = 0; sheet < cell.num_sheets; ++sheet) {
        const int64_t v = first_vertex[s] + cell.first_vertex + sheet;
        const Around& a = around[v];
        float& time = mesh.vertices(3, v);
        if (a.count == 0 || (time >= a.earliest && time <= a.latest)) continue;
        time = std::clamp(a.sum / static_cast<float>(a.count), earliest, latest);
        ++num_moved;
      }
    }
  }
  return num_moved;
}

}  // namespace

void FlattenTimeExtrema(const Layers& layers, const std::vector<int64_t>& first_vertex,
                        mesh::SpaceTimeMesh& mesh) {
  for (int pass = 0; pass < kNumPasses; ++pass) {
    if (FlattenOnce(layers, first_vertex, mesh) == 0) return;
  }
}

}  // namespace liquidblend::spacetime
