#include "worker/spacetime/time_extrema.h"

#include <algorithm>
#include <limits>

namespace liquidblend::spacetime {
namespace {

constexpr int kNumPasses = 3;
constexpr double kMargin = 0.05;  // of a slab, from its layers

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
    const double begin = layers.times[s].time, end = layers.times[s + 1].time;
    const auto earliest = static_cast<float>(begin + kMargin * (end - begin));
    const auto latest = static_cast<float>(end - kMargin * (end - begin));
    for (int64_t n = 0; n < layers.slabs[s].num_vertices(); ++n) {
      const int64_t v = first_vertex[s] + n;
      const Around& a = around[v];
      float& time = mesh.vertices(3, v);
      if (a.count == 0 || (time >= a.earliest && time <= a.latest)) continue;
      time = std::clamp(a.sum / static_cast<float>(a.count), earliest, latest);
      ++num_moved;
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
