#include "server/frames/make_frame.h"

#include <algorithm>
#include <span>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/base/errors.h"
#include "server/base/names.h"
#include "server/blend/blend.h"
#include "server/encode/draco.h"
#include "server/encode/mesh_files.h"
#include "server/finish/normals.h"
#include "server/finish/smooth_surface.h"
#include "server/finish/velocities.h"
#include "server/frames/encoding.h"

namespace liquidblend::server {
namespace {

constexpr double kMaxTemporalOffsetEdges = 0.25;

// Costs in ExpectedCells(): cells that count for every frame, and factors of stages that are slower
// than slicing and writing.
constexpr int64_t kCellsPerCall = 20'000;
constexpr int64_t kSlowEncoderFactor = 8;
constexpr int64_t kFinishFactor = 2;

finish::SmoothingOptions SmoothingOf(const v1::SurfaceOptions& surface) {
  finish::SmoothingOptions options;
  options.passes = surface.smoothing_passes();
  if (surface.smoothing() == v1::SurfaceOptions::LAPLACIAN) {
    options.kind = finish::SmoothingKind::kLaplacian;
  }
  if (surface.smoothing_strength() != 0.0) options.strength = surface.smoothing_strength();
  return options;
}

finish::TemporalOptions TemporalOf(const mesh::RegisteredFamily& family,
                                   const v1::SurfaceOptions& surface) {
  finish::TemporalOptions options;
  options.strength = surface.temporal_smoothing();
  options.max_offset_m = kMaxTemporalOffsetEdges * family.edge_length_m;
  return options;
}

bool Wants(const v1::SurfaceOptions& surface, v1::SurfaceOptions::Attribute attribute) {
  return std::find(surface.attributes().begin(), surface.attributes().end(), attribute) !=
         surface.attributes().end();
}

// Cuts the candidate cells, smoothed in time if that is asked for.
mesh::TriangleMesh CutCells(const catalog::LoadedLevel& level, const blend::Blender& blender,
                            const v1::SurfaceOptions& surface, FrameBuffers& buffers) {
  const finish::TemporalOptions options = TemporalOf(level.family, surface);
  buffers.workspace.helpers = buffers.helpers;
  if (options.strength == 0.0) return slice::March(level.index, blender, buffers.workspace);
  buffers.workspace.helpers = nullptr;  // the smoother is for one thread
  const finish::TimeSmoother smoother(level.time_links, blender, options, buffers.temporal);
  return slice::March(level.index, smoother, buffers.workspace);
}

std::span<const mesh::Float4> Place(const blend::Blender& blender,
                                    std::span<const int32_t> vertices,
                                    std::vector<mesh::Float4>& positions) {
  positions.resize(vertices.size());
  blender.Place(vertices, positions.data());
  return positions;
}

void FinishSurface(const catalog::LoadedLevel& level, const blend::Blender& blender,
                   const v1::SurfaceOptions& options, FrameBuffers& buffers,
                   mesh::TriangleMesh& surface) {
  if (Wants(options, v1::SurfaceOptions::VELOCITIES)) {
    const slice::Workspace& workspace = buffers.workspace;
    const auto num_vertices = static_cast<size_t>(surface.num_vertices());
    const auto near = std::span(workspace.near_vertex).first(num_vertices);
    const auto far = std::span(workspace.far_vertex).first(num_vertices);
    const finish::CrossedEdges crossed{near, far, Place(blender, near, buffers.near_positions),
                                       Place(blender, far, buffers.far_positions),
                                       workspace.time_ticks};
    finish::AddVelocities(level.family, crossed, surface);
  }
  finish::SmoothSurface(SmoothingOf(options), surface);
  if (Wants(options, v1::SurfaceOptions::NORMALS)) finish::AddNormals(surface);
}

// Checks the surface options and adds their violations.
void CheckSurface(const mesh::RegisteredFamily& family, const v1::SurfaceOptions& surface,
                  FieldViolations& violations) {
  const auto num_levels = static_cast<int>(family.coarser_levels.size());
  violations.AddIf(surface.level_of_detail() < 0 || surface.level_of_detail() > num_levels,
                   "surface.level_of_detail",
                   absl::StrCat("must be in [0, ", num_levels, "] for family ", family.name,
                                ", got ", surface.level_of_detail()));
  violations.AddIf(!v1::SurfaceOptions::Smoothing_IsValid(surface.smoothing()), "surface.smoothing",
                   absl::StrCat("unknown kind ", surface.smoothing()));
  finish::SmoothingOptions smoothing = SmoothingOf(surface);
  const absl::Status all = smoothing.Validate();
  smoothing.passes = 0;
  const absl::Status strength = smoothing.Validate();
  violations.AddIf(!strength.ok(), "surface.smoothing_strength", std::string(strength.message()));
  violations.AddIf(strength.ok() && !all.ok(), "surface.smoothing_passes",
                   std::string(all.message()));
  const absl::Status temporal = TemporalOf(family, surface).Validate();
  violations.AddIf(!temporal.ok(), "surface.temporal_smoothing", std::string(temporal.message()));
  for (const int attribute : surface.attributes()) {
    violations.AddIf(
        attribute != v1::SurfaceOptions::NORMALS && attribute != v1::SurfaceOptions::VELOCITIES,
        "surface.attributes", absl::StrCat("unknown attribute ", attribute));
  }
}

// Checks between stages whether the frame is still wanted.
absl::Status CheckIsWanted(const FrameBuffers& buffers) {
  if (buffers.stop == nullptr || !buffers.stop->load(std::memory_order_relaxed)) {
    return absl::OkStatus();
  }
  return absl::CancelledError("nobody waits for the frame any more");
}

absl::StatusOr<std::string> Encode(const catalog::LoadedFamily& loaded,
                                   const v1::Encoding& encoding, const mesh::TriangleMesh& surface,
                                   FrameBuffers& buffers) {
  if (encoding.format() == v1::Encoding::PLY || encoding.format() == v1::Encoding::OBJ) {
    LB_RETURN_IF_ERROR(mesh::Validate(surface));
    return encoding.format() == v1::Encoding::PLY ? encode::EncodePly(surface)
                                                  : encode::EncodeObj(surface);
  }
  return encode::EncodeDraco(surface, DracoOptionsOf(loaded.grid, encoding), buffers.writer,
                             buffers.helpers);
}

void SetVector(const Eigen::Vector3f& from, v1::Vector3* to) {
  to->set_x(from.x());
  to->set_y(from.y());
  to->set_z(from.z());
}

v1::Frame Reply(const mesh::RegisteredFamily& family, const FrameQuery& query,
                const mesh::TriangleMesh& surface, std::string data) {
  v1::Frame frame;
  frame.set_data(std::move(data));
  frame.set_family(FamilyName(family.name));
  frame.set_version(family.version);
  frame.mutable_weights()->Add(query.weights.begin(), query.weights.end());
  frame.set_extrapolated(query.is_extrapolated);
  frame.set_clamped(query.is_clamped);
  frame.set_time_s(query.time_s);
  frame.set_num_vertices(surface.num_vertices());
  frame.set_num_triangles(surface.num_triangles());
  if (surface.num_vertices() > 0) SetBounds(surface, *frame.mutable_bounds());
  return frame;
}

}  // namespace

void SetBounds(const mesh::TriangleMesh& surface, v1::Bounds& bounds) {
  SetVector(surface.vertices.rowwise().minCoeff(), bounds.mutable_min());
  SetVector(surface.vertices.rowwise().maxCoeff(), bounds.mutable_max());
}

absl::Status CheckQuery(const catalog::LoadedFamily& loaded, const FrameQuery& query) {
  LB_RETURN_IF_ERROR(AtField("weights", blend::CheckWeights(loaded.family, query.weights)));
  FieldViolations violations;
  CheckEncoding(loaded.grid, absl::StrCat("family ", loaded.family.name), query.encoding,
                violations);
  CheckSurface(loaded.family, query.surface, violations);
  violations.AddIf(query.encoding.format() == v1::Encoding::OBJ &&
                       Wants(query.surface, v1::SurfaceOptions::VELOCITIES),
                   "surface.attributes", "OBJ holds no velocities; ask for PLY");
  return violations.ToStatus();
}

int64_t ExpectedCells(const catalog::LoadedFamily& loaded, const FrameQuery& query) {
  const mesh::RegisteredFamily& level = loaded.levels[query.surface.level_of_detail()]->family;
  int64_t cells = level.num_cells() / std::max(1, level.num_frames);
  const bool is_finished = query.surface.smoothing_passes() > 0 ||
                           query.surface.temporal_smoothing() > 0 ||
                           !query.surface.attributes().empty();
  const bool is_draco =
      query.encoding.format() != v1::Encoding::PLY && query.encoding.format() != v1::Encoding::OBJ;
  const bool is_by_libdraco = is_draco && (query.encoding.preset() == v1::Encoding::SMALLEST ||
                                           !query.surface.attributes().empty());
  if (is_finished) cells *= kFinishFactor;
  if (is_by_libdraco || query.encoding.format() == v1::Encoding::OBJ) cells *= kSlowEncoderFactor;
  return kCellsPerCall + cells;
}

absl::StatusOr<v1::Frame> MakeFrame(const catalog::LoadedFamily& loaded, const FrameQuery& query,
                                    FrameBuffers& buffers) {
  LB_RETURN_IF_ERROR(CheckQuery(loaded, query));
  metrics::StopWatch watch;
  const catalog::LoadedLevel& level = *loaded.levels[query.surface.level_of_detail()];
  LB_RETURN_IF_ERROR(AtField("time_s", slice::FindCandidates(level.index, query.weights,
                                                             query.time_s, buffers.workspace)));
  LB_RETURN_IF_ERROR(CheckIsWanted(buffers));
  const blend::Blender blender(level.family, query.weights);
  buffers.workspace.stop = buffers.stop;
  mesh::TriangleMesh surface = CutCells(level, blender, query.surface, buffers);
  LB_RETURN_IF_ERROR(CheckIsWanted(buffers));
  LB_RETURN_IF_ERROR(loaded.CheckFile());  // encoders take closed surfaces only
  buffers.times.slice = watch.Lap();
  FinishSurface(level, blender, query.surface, buffers, surface);
  LB_RETURN_IF_ERROR(CheckIsWanted(buffers));
  buffers.times.finish = watch.Lap();
  LB_ASSIGN_OR_RETURN(std::string data, Encode(loaded, query.encoding, surface, buffers));
  buffers.times.encode = watch.Lap();
  LB_RETURN_IF_ERROR(loaded.CheckFile());
  return Reply(loaded.family, query, surface, std::move(data));
}

void CountFrame(const catalog::LoadedFamily& loaded, const FrameQuery& query,
                const v1::Frame& frame, const FrameBuffers& buffers, metrics::Metrics& metrics) {
  metrics.CountFrame(loaded.family.name, EncodingLabel(query.encoding), frame.data().size(),
                     buffers.times);
}

}  // namespace liquidblend::server
