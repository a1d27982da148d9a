// An indexed family, weights and a time -> the liquid's surface, finished. Start reading here to
// see how a frame is made.
#pragma once

#include <atomic>
#include <span>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "core/finish/smooth_in_time.h"
#include "core/finish/smooth_surface.h"
#include "core/frames/indexed_family.h"
#include "core/mesh/triangle_mesh.h"
#include "core/parallel/helpers.h"
#include "core/slice/slice.h"

namespace liquidblend::frames {

// What is made of the slice. The defaults leave it as it is.
struct SurfaceOptions {
  int level_of_detail = 0;  // [0, number of the family's coarser levels]; 0: the finest
  finish::SmoothingOptions smoothing;
  double temporal_smoothing = 0.0;  // [0, 1]; against flicker
  bool normals = false;
  bool velocities = false;
  bool rest_positions = false;
};

// The options of smoothing in time.
finish::TemporalOptions TemporalOptionsOf(const mesh::RegisteredFamily& family,
                                          double temporal_smoothing);

// Buffers and workspaces that are reused from surface to surface. Used by one call at a time.
struct SurfaceBuffers {
  slice::Workspace workspace;
  finish::TemporalWorkspace temporal;
  std::vector<mesh::Float4> near_positions;  // the ends of the edges that the surface lies on
  std::vector<mesh::Float4> far_positions;
  // Not owned: set to true to end the call early; or null.
  const std::atomic<bool>* stop = nullptr;
  parallel::Helpers* helpers = nullptr;  // not owned: may help; or null
  // Times of the last surface.
  absl::Duration slice_time, finish_time;
};

// Makes the surface: blends, slices, smooths it, adds attributes.
//   weights  one per target, clamped: see ClampWeights()
//   check    called after slicing; its error is returned. A surface that was sliced from damaged
//            memory need not be closed, and must not be used further.
// Requires: CheckWeights().ok(); options are in range.
// Errors: kOutOfRange (time_s is not in [0, duration_s]), kCancelled soon after buffers.stop has
// become true, and those of `check`. Threads: safe with buffers of one's own; the same bytes
// always.
absl::StatusOr<mesh::TriangleMesh> MakeSurface(const IndexedFamily& indexed,
                                               std::span<const double> weights, double time_s,
                                               const SurfaceOptions& options,
                                               absl::FunctionRef<absl::Status()> check,
                                               SurfaceBuffers& buffers);

}  // namespace liquidblend::frames
