#include "core/frames/make_surface.h"

#include <chrono>

#include "core/base/status_macros.h"
#include "core/blend/blend.h"
#include "core/finish/normals.h"
#include "core/finish/rest_positions.h"
#include "core/finish/velocities.h"

namespace liquidblend::frames {
namespace {

constexpr double kMaxTemporalOffsetEdges = 0.25;

using Clock = std::chrono::steady_clock;

// Cuts the candidate cells, smoothed in time if that is asked for.
mesh::TriangleMesh CutCells(const IndexedLevel& level, const blend::Blender& blender,
                            const SurfaceOptions& options, SurfaceBuffers& buffers) {
  buffers.workspace.stop = buffers.stop;
  buffers.workspace.helpers = buffers.helpers;
  if (options.temporal_smoothing == 0.0) {
    return slice::March(level.index, blender, buffers.workspace);
  }
  buffers.workspace.helpers = nullptr;  // the smoother is for one thread
  const finish::TimeSmoother smoother(level.time_links, blender,
                                      TemporalOptionsOf(level.family, options.temporal_smoothing),
                                      buffers.temporal);
  return slice::March(level.index, smoother, buffers.workspace);
}

std::span<const mesh::Float4> Place(const blend::Blender& blender,
                                    std::span<const int32_t> vertices,
                                    std::vector<mesh::Float4>& positions) {
  positions.resize(vertices.size());
  blender.Place(vertices, positions.data());
  return positions;
}

void FinishSurface(const IndexedLevel& level, const blend::Blender& blender,
                   const SurfaceOptions& options, SurfaceBuffers& buffers,
                   mesh::TriangleMesh& surface) {
  if (options.velocities || options.rest_positions) {
    const slice::Workspace& workspace = buffers.workspace;
    const auto num_vertices = static_cast<size_t>(surface.num_vertices());
    const auto near = std::span(workspace.near_vertex).first(num_vertices);
    const auto far = std::span(workspace.far_vertex).first(num_vertices);
    const finish::CrossedEdges crossed{near, far, Place(blender, near, buffers.near_positions),
                                       Place(blender, far, buffers.far_positions),
                                       workspace.time_ticks};
    if (options.velocities) finish::AddVelocities(level.family, crossed, surface);
    if (options.rest_positions) finish::AddRestPositions(level.family, crossed, surface);
  }
  finish::SmoothSurface(options.smoothing, surface);
  if (options.normals) finish::AddNormals(surface);
}

// Checks between stages whether the surface is still wanted.
absl::Status CheckIsWanted(const SurfaceBuffers& buffers) {
  if (buffers.stop == nullptr || !buffers.stop->load(std::memory_order_relaxed)) {
    return absl::OkStatus();
  }
  return absl::CancelledError("nobody waits for the frame any more");
}

}  // namespace

finish::TemporalOptions TemporalOptionsOf(const mesh::RegisteredFamily& family,
                                          double temporal_smoothing) {
  finish::TemporalOptions options;
  options.strength = temporal_smoothing;
  options.max_offset_m = kMaxTemporalOffsetEdges * family.edge_length_m;
  return options;
}

absl::StatusOr<mesh::TriangleMesh> MakeSurface(const IndexedFamily& indexed,
                                               std::span<const double> weights, double time_s,
                                               const SurfaceOptions& options,
                                               absl::FunctionRef<absl::Status()> check,
                                               SurfaceBuffers& buffers) {
  const Clock::time_point start = Clock::now();
  const IndexedLevel& level = *indexed.levels[options.level_of_detail];
  LB_RETURN_IF_ERROR(slice::FindCandidates(level.index, weights, time_s, buffers.workspace));
  LB_RETURN_IF_ERROR(CheckIsWanted(buffers));
  const blend::Blender blender(level.family, weights);
  mesh::TriangleMesh surface = CutCells(level, blender, options, buffers);
  LB_RETURN_IF_ERROR(CheckIsWanted(buffers));
  LB_RETURN_IF_ERROR(check());
  const Clock::time_point sliced = Clock::now();
  FinishSurface(level, blender, options, buffers, surface);
  LB_RETURN_IF_ERROR(CheckIsWanted(buffers));
  buffers.slice_time = absl::FromChrono(sliced - start);
  buffers.finish_time = absl::FromChrono(Clock::now() - sliced);
  return surface;
}

}  // namespace liquidblend::frames
