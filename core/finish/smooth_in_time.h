// Smoothing in time, against flicker: the space-time mesh's vertices are moved, in space only,
// towards the straight line between the positions of their place on the surface a little earlier
// and a little later. Since vertices keep their times and cells, slices stay closed.
//
//   const finish::TimeSmoother smooth(links, blender, options, workspace);
//   surface = slice::March(index, smooth, slice_workspace);
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "core/finish/time_links.h"
#include "core/mesh/registered_family.h"
#include "core/mesh/target_motion.h"

namespace liquidblend::finish {

// Options of smoothing in time.
struct TemporalOptions {
  double strength = 0.0;          // [0, 1]; 0: none; 1: weights 1/4, 1/2, 1/4
  double max_offset_m = 0.0;      // >= 0; no vertex is moved further
  absl::Status Validate() const;  // names the first field out of range, and its value
};

// Workspace of a TimeSmoother. Keeps its memory from one call to the next.
struct TemporalWorkspace {
  std::vector<int32_t> neighbors;
  std::vector<mesh::Float4> before, after;
};

// Placer of vertices that are smoothed in time. Threads: one at a time.
class TimeSmoother final : public mesh::VertexPlacer {
 public:
  // Requires: options.Validate().ok(); all outlive this.
  TimeSmoother(const TimeLinks& links, const mesh::VertexPlacer& placer,
               const TemporalOptions& options, TemporalWorkspace& workspace)
      : links_(links), placer_(placer), options_(options), workspace_(workspace) {}

  // Sets the placer's positions, smoothed. A vertex stays without a link on both sides, or if its
  // links do not lie before and after it in the blend.  Cost: the placer's for three times as many.
  void Place(std::span<const int32_t> vertices, mesh::Float4* positions) const override;
  void Prefetch(std::span<const int32_t> vertices) const override { placer_.Prefetch(vertices); }

 private:
  void PlaceNeighbors(std::span<const int32_t> vertices, std::span<const int32_t> links,
                      std::vector<mesh::Float4>& positions) const;

  const TimeLinks& links_;
  const mesh::VertexPlacer& placer_;
  const TemporalOptions options_;
  TemporalWorkspace& workspace_;
};

}  // namespace liquidblend::finish
