// Smoothing of a slice's surface (paper, section 8).
#pragma once

#include "absl/status/status.h"
#include "core/mesh/triangle_mesh.h"

namespace liquidblend::finish {

// Kind of a smoothing pass.
enum class SmoothingKind {
  kLaplacian,  // the paper's step; a ball loses volume with each pass
  kTaubin,     // each pass is followed by one outward, which keeps the volume
};

// Options of smoothing a surface.
struct SmoothingOptions {
  int passes = 0;  // [0, 32]; 0: none
  SmoothingKind kind = SmoothingKind::kTaubin;
  double strength = 0.5;          // (0, 1]; how far a pass goes towards the neighbours' mean
  double max_offset_edges = 0.5;  // > 0; of a vertex, all passes together, in mean edge lengths
  absl::Status Validate() const;  // names the first field out of range, and its value
};

// Moves each vertex towards the mean of its neighbours, `passes` times; no vertex ends further than
// the limit from its first position. Only positions change, so closed surfaces stay closed.
// Requires: options.Validate().ok(); surface passed Validate(). Threads: safe, same bytes always.
// Cost: O(passes x triangles).
void SmoothSurface(const SmoothingOptions& options, mesh::TriangleMesh& surface);

}  // namespace liquidblend::finish
