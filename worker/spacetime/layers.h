// The animation sampled on the layers of a grid, and the vertices of the slabs between them.
// Internal to worker/spacetime.
#pragma once

#include <functional>
#include <vector>

#include "absl/status/statusor.h"
#include "core/parallel/arena.h"
#include "worker/spacetime/plan_layers.h"
#include "worker/spacetime/surface_nets.h"

namespace liquidblend::spacetime {

struct Layers {
  Grid grid;
  std::vector<LayerTime> times;
  std::vector<InsideBits> inside;  // one per layer
  std::vector<Slab> slabs;         // slab s lies between layers s and s + 1
};

// Samples the layers and places the vertices, a few layers at a time: distances are only ever held
// for those.
// Errors: kResourceExhausted if the grid has 2^31 points or more.
// Threads: same bytes for any thread count.
absl::StatusOr<Layers> SampleLayers(const mesh::Animation& animation, std::vector<LayerTime> times,
                                    double spacing_m, const parallel::Arena& arena,
                                    const std::function<void(double)>& progress);

}  // namespace liquidblend::spacetime
