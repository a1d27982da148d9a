#include "server/rpc/make_frame.h"

#include <algorithm>
#include <span>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/blend/blend.h"
#include "server/encode/draco.h"
#include "server/finish/normals.h"
#include "server/finish/smooth_surface.h"
#include "server/finish/velocities.h"
#include "server/rpc/errors.h"
#include "server/rpc/names.h"

namespace liquidblend::rpc {
namespace {

constexpr int kMinPositionBits = 8;
constexpr int kMaxPositionBits = 20;
constexpr double kMaxTemporalOffsetEdges = 0.25;

encode::DracoOptions DracoOptionsOf(const catalog::LoadedFamily& loaded,
                                    const v1::Encoding& encoding) {
  encode::DracoOptions options;
  if (encoding.preset() == v1::Encoding::BALANCED) options.preset = encode::Preset::kBalanced;
  if (encoding.preset() == v1::Encoding::SMALLEST) options.preset = encode::Preset::kSmallest;
  if (encoding.position_bits() != 0) options.position_bits = encoding.position_bits();
  options.grid = loaded.grid;
  return options;
}

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

// Blends the vertices that the slice needs; returns them smoothed in time if that is asked for.
const std::vector<mesh::Float4>& PlaceVertices(const catalog::LoadedLevel& level,
                                               const FrameQuery& query, FrameBuffers& buffers) {
  const auto& ranges = buffers.workspace.vertex_ranges;
  blend::BlendVertices(level.family, query.weights, ranges, buffers.positions);
  const finish::TemporalOptions options = TemporalOf(level.family, query.surface);
  if (options.strength == 0.0) return buffers.positions;
  finish::FindTimeNeighbors(level.time_links, ranges, buffers.temporal);
  blend::BlendVertices(level.family, query.weights, buffers.temporal.vertex_ranges,
                       buffers.wide_positions);
  finish::SmoothInTime(level.time_links, buffers.wide_positions, ranges, options, buffers.temporal,
                       buffers.smooth_positions);
  return buffers.smooth_positions;
}

void FinishSurface(const catalog::LoadedLevel& level, const v1::SurfaceOptions& options,
                   const FrameBuffers& buffers, mesh::TriangleMesh& surface) {
  const slice::Workspace& workspace = buffers.workspace;
  if (Wants(options, v1::SurfaceOptions::VELOCITIES)) {
    const auto num_vertices = static_cast<size_t>(surface.num_vertices());
    const finish::CrossedEdges crossed{workspace.vertex_ranges, buffers.positions,
                                       std::span(workspace.near_vertex).first(num_vertices),
                                       std::span(workspace.far_vertex).first(num_vertices),
                                       workspace.time_frames};
    finish::AddVelocities(level.family, crossed, surface);
  }
  finish::SmoothSurface(SmoothingOf(options), surface);
  if (Wants(options, v1::SurfaceOptions::NORMALS)) finish::AddNormals(surface);
}

// The violations of the surface options.
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
  frame.set_time_s(query.time_s);
  frame.set_num_vertices(surface.num_vertices());
  frame.set_num_triangles(surface.num_triangles());
  if (surface.num_vertices() > 0) {
    SetVector(surface.vertices.rowwise().minCoeff(), frame.mutable_bounds()->mutable_min());
    SetVector(surface.vertices.rowwise().maxCoeff(), frame.mutable_bounds()->mutable_max());
  }
  return frame;
}

}  // namespace

absl::Status CheckQuery(const mesh::RegisteredFamily& family, const FrameQuery& query) {
  LB_RETURN_IF_ERROR(AtField("weights", blend::CheckWeights(family, query.weights)));
  const v1::Encoding& encoding = query.encoding;
  FieldViolations violations;
  violations.AddIf(encoding.format() != v1::Encoding::FORMAT_UNSPECIFIED &&
                       encoding.format() != v1::Encoding::DRACO,
                   "encoding.format", absl::StrCat("unknown format ", encoding.format()));
  violations.AddIf(encoding.position_bits() != 0 && (encoding.position_bits() < kMinPositionBits ||
                                                     encoding.position_bits() > kMaxPositionBits),
                   "encoding.position_bits",
                   absl::StrCat("must be 0 or in [", kMinPositionBits, ", ", kMaxPositionBits,
                                "], got ", encoding.position_bits()));
  violations.AddIf(!v1::Encoding::Preset_IsValid(encoding.preset()), "encoding.preset",
                   absl::StrCat("unknown preset ", encoding.preset()));
  CheckSurface(family, query.surface, violations);
  return violations.ToStatus();
}

absl::StatusOr<v1::Frame> MakeFrame(const catalog::LoadedFamily& loaded, const FrameQuery& query,
                                    FrameBuffers& buffers) {
  LB_RETURN_IF_ERROR(CheckQuery(loaded.family, query));
  const catalog::LoadedLevel& level = *loaded.levels[query.surface.level_of_detail()];
  LB_RETURN_IF_ERROR(AtField("time_s", slice::FindCandidates(level.index, query.weights,
                                                             query.time_s, buffers.workspace)));
  const std::vector<mesh::Float4>& positions = PlaceVertices(level, query, buffers);
  mesh::TriangleMesh surface = slice::March(level.index, positions, buffers.workspace);
  FinishSurface(level, query.surface, buffers, surface);
  LB_ASSIGN_OR_RETURN(
      std::string data,
      encode::EncodeDraco(surface, DracoOptionsOf(loaded, query.encoding), buffers.writer));
  return Reply(loaded.family, query, surface, std::move(data));
}

}  // namespace liquidblend::rpc
