// Takes the flicker out of a blend: the space-time mesh's vertices are moved, in space only,
// towards the straight line between where their place on the surface is a little earlier and a
// little later. Since vertices keep their times and cells, slices stay closed.
//
//   finish::FindTimeNeighbors(links, ranges, workspace);
//   blend::BlendVertices(family, weights, workspace.vertex_ranges, wide_positions);
//   finish::SmoothInTime(links, wide_positions, ranges, options, workspace, positions);
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "core/mesh/registered_family.h"
#include "core/mesh/target_motion.h"
#include "server/finish/time_links.h"

namespace liquidblend::finish {

struct TemporalOptions {
  double strength = 0.0;          // [0, 1]; 0: none; 1: weights 1/4, 1/2, 1/4
  double max_offset_m = 0.0;      // >= 0; no vertex is moved further
  absl::Status Validate() const;  // names the first field out of range, and its value
};

// Keeps its memory from one frame to the next.
struct TemporalWorkspace {
  // Set by FindTimeNeighbors: whose positions SmoothInTime() needs.
  std::vector<mesh::VertexRange> vertex_ranges;  // ascending, not overlapping, not touching

  // The stage's own.
  std::vector<uint8_t> is_block_needed;  // per block of vertices
  std::vector<int32_t> block_offset;     // per needed block: where its positions begin
};

// Finds the vertices of `ranges` and those that they are linked to.
// Requires: ranges ascending, not overlapping, inside the family.  Cost: O(vertices in ranges).
void FindTimeNeighbors(const TimeLinks& links, std::span<const mesh::VertexRange> ranges,
                       TemporalWorkspace& workspace);

// Positions of `ranges`, smoothed; a vertex without a link on both sides, or whose links do not lie
// before and after it in the blend, stays.
//   wide_positions  as blended for workspace.vertex_ranges
//   positions       grown if too small, never shrunk: the vertices of `ranges`, one after the other
// Requires: options.Validate().ok(); FindTimeNeighbors() was called with the same links and ranges.
// Threads: safe with a workspace per caller; same bytes always.  Cost: O(vertices in ranges).
void SmoothInTime(const TimeLinks& links, std::span<const mesh::Float4> wide_positions,
                  std::span<const mesh::VertexRange> ranges, const TemporalOptions& options,
                  const TemporalWorkspace& workspace, std::vector<mesh::Float4>& positions);

}  // namespace liquidblend::finish
