// The animation sampled on the layers of a grid, and the vertices of the slabs between them.
// Internal to worker/spacetime.
#pragma once

#include <algorithm>
#include <functional>
#include <vector>

#include "absl/status/statusor.h"
#include "core/parallel/arena.h"
#include "worker/spacetime/nets/plan_layers.h"
#include "worker/spacetime/nets/surface_nets.h"

namespace liquidblend::spacetime {

struct LayerOptions {
  double spacing_m = 0.0;        // > 0; of the grid
  double max_motion_m = 0.0;     // > 0; of the surface in one step of a slab; see PlanLayers
  bool keep_thin_sheets = true;  // see BuildOptions
};

struct Layers {
  Grid grid;
  LayerPlan plan;
  std::vector<InsideBits> inside;  // one per layer; in between, known around the blocks cut there
  std::vector<Slab> slabs;

  // The slab that the step after a layer belongs to.
  int SlabOf(int layer) const {
    const auto& first = plan.first_layer;
    return static_cast<int>(std::upper_bound(first.begin(), first.end() - 1, layer) -
                            first.begin()) -
           1;
  }
  double begin(size_t slab) const { return plan.layers[plan.first_layer[slab]].time; }
  double end(size_t slab) const { return plan.layers[plan.first_layer[slab + 1]].time; }
};

// Samples the layers and places the vertices, a few layers at a time: distances are only ever held
// for those.
// Errors: base::MemoryLimitError() if the grid has 2^31 points or more, or needs more memory than
// the process may still allocate.
// Threads: same bytes for any thread count.
absl::StatusOr<Layers> SampleLayers(const mesh::Animation& animation, const LayerOptions& options,
                                    const parallel::Arena& arena,
                                    const std::function<void(double)>& progress);

}  // namespace liquidblend::spacetime
