#include "server/frames/make_frame.h"

#include <algorithm>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/frames/blend_weights.h"
#include "server/base/errors.h"
#include "server/base/names.h"
#include "server/encode/draco.h"
#include "server/encode/mesh_files.h"
#include "server/encode/meshopt.h"
#include "server/frames/encoding.h"

namespace liquidblend::server {
namespace {

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

bool Wants(const v1::SurfaceOptions& surface, v1::SurfaceOptions::Attribute attribute) {
  return std::find(surface.attributes().begin(), surface.attributes().end(), attribute) !=
         surface.attributes().end();
}

frames::SurfaceOptions OptionsOf(const v1::SurfaceOptions& surface) {
  frames::SurfaceOptions options;
  options.level_of_detail = surface.level_of_detail();
  options.smoothing = SmoothingOf(surface);
  options.temporal_smoothing = surface.temporal_smoothing();
  options.normals = Wants(surface, v1::SurfaceOptions::NORMALS);
  options.velocities = Wants(surface, v1::SurfaceOptions::VELOCITIES);
  options.rest_positions = Wants(surface, v1::SurfaceOptions::REST_POSITIONS);
  return options;
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
  const absl::Status temporal =
      frames::TemporalOptionsOf(family, surface.temporal_smoothing()).Validate();
  violations.AddIf(!temporal.ok(), "surface.temporal_smoothing", std::string(temporal.message()));
  for (const int attribute : surface.attributes()) {
    const bool is_known = attribute != v1::SurfaceOptions::ATTRIBUTE_UNSPECIFIED &&
                          v1::SurfaceOptions::Attribute_IsValid(attribute);
    violations.AddIf(!is_known, "surface.attributes",
                     absl::StrCat("unknown attribute ", attribute));
  }
}

absl::StatusOr<std::string> Encode(const catalog::LoadedFamily& loaded,
                                   const v1::Encoding& encoding, const mesh::TriangleMesh& surface,
                                   FrameBuffers& buffers) {
  if (encoding.format() == v1::Encoding::PLY || encoding.format() == v1::Encoding::OBJ) {
    LB_RETURN_IF_ERROR(mesh::Validate(surface));
    return encoding.format() == v1::Encoding::PLY ? encode::EncodePly(surface)
                                                  : encode::EncodeObj(surface);
  }
  if (encoding.format() == v1::Encoding::MESHOPT) {
    return encode::EncodeMeshopt(
        surface, RoundingOptionsOf(loaded.grid, loaded.family.duration_s(), encoding));
  }
  return encode::EncodeDraco(surface, DracoOptionsOf(loaded.grid, encoding), buffers.writer,
                             buffers.surface.helpers);
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
  LB_RETURN_IF_ERROR(AtField("weights", frames::CheckWeights(loaded, query.weights)));
  FieldViolations violations;
  CheckEncoding(loaded.grid, absl::StrCat("family ", loaded.family.name), query.encoding,
                violations);
  CheckSurface(loaded.family, query.surface, violations);
  const bool is_obj = query.encoding.format() == v1::Encoding::OBJ;
  violations.AddIf(is_obj && Wants(query.surface, v1::SurfaceOptions::VELOCITIES),
                   "surface.attributes", "OBJ holds no velocities; ask for PLY");
  violations.AddIf(is_obj && Wants(query.surface, v1::SurfaceOptions::REST_POSITIONS),
                   "surface.attributes", "OBJ holds no rest positions; ask for PLY");
  return violations.ToStatus();
}

int64_t ExpectedCells(const catalog::LoadedFamily& loaded, const FrameQuery& query) {
  const mesh::RegisteredFamily& level = loaded.levels[query.surface.level_of_detail()]->family;
  int64_t cells = level.num_cells() / std::max(1, level.num_frames);
  const bool is_finished = query.surface.smoothing_passes() > 0 ||
                           query.surface.temporal_smoothing() > 0 ||
                           !query.surface.attributes().empty();
  const v1::Encoding::Format format = query.encoding.format();
  const bool is_draco = format == v1::Encoding::DRACO || format == v1::Encoding::FORMAT_UNSPECIFIED;
  const bool is_by_libdraco = is_draco && (query.encoding.preset() == v1::Encoding::SMALLEST ||
                                           !query.surface.attributes().empty());
  if (is_finished) cells *= kFinishFactor;
  if (is_by_libdraco || format == v1::Encoding::OBJ) cells *= kSlowEncoderFactor;
  return kCellsPerCall + cells;
}

absl::StatusOr<v1::Frame> MakeFrame(const catalog::LoadedFamily& loaded, const FrameQuery& query,
                                    FrameBuffers& buffers) {
  LB_RETURN_IF_ERROR(CheckQuery(loaded, query));
  absl::StatusOr<mesh::TriangleMesh> surface = frames::MakeSurface(
      loaded, query.weights, query.time_s, OptionsOf(query.surface),
      [&] { return loaded.CheckFile(); },  // encoders take closed surfaces only
      buffers.surface);
  if (absl::IsOutOfRange(surface.status())) return AtField("time_s", surface.status());
  LB_RETURN_IF_ERROR(surface.status());
  buffers.times.slice = buffers.surface.slice_time;
  buffers.times.finish = buffers.surface.finish_time;
  metrics::StopWatch watch;
  LB_ASSIGN_OR_RETURN(std::string data, Encode(loaded, query.encoding, *surface, buffers));
  buffers.times.encode = watch.Lap();
  LB_RETURN_IF_ERROR(loaded.CheckFile());
  return Reply(loaded.family, query, *surface, std::move(data));
}

void CountFrame(const catalog::LoadedFamily& loaded, const FrameQuery& query,
                const v1::Frame& frame, const FrameBuffers& buffers, metrics::Metrics& metrics) {
  metrics.CountFrame(loaded.family.name, EncodingLabel(query.encoding), frame.data().size(),
                     buffers.times);
}

}  // namespace liquidblend::server
