#include "client/player/file_source.h"

#include <fcntl.h>

#include <chrono>
#include <cmath>
#include <utility>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "client/src/decode/unpack.h"
#include "core/base/posix_file.h"
#include "core/base/status_macros.h"
#include "core/frames/blend_weights.h"
#include "core/frames/rounded_surface.h"
#include "core/store/blobs/mapped_file.h"
#include "core/store/files/files.h"

namespace liquidblend::player {
namespace {

using Clock = std::chrono::steady_clock;

absl::StatusOr<std::shared_ptr<const store::Blob>> Map(const std::string& path) {
  LB_ASSIGN_OR_RETURN(const base::FileHandle file, base::OpenFile(path, O_RDONLY));
  LB_ASSIGN_OR_RETURN(const size_t size, base::SizeOfFile(file, path));
  return store::MapFile(file, size, path);
}

Bounds BoundsOf(const mesh::RegisteredFamily& family) {
  const auto vector = [](const std::array<float, 3>& v) { return Vector3{v[0], v[1], v[2]}; };
  return {vector(family.domain_min), vector(family.domain_max)};
}

// Names as the server says them; the file has ids.
FamilyFacts FactsOf(const mesh::RegisteredFamily& family) {
  FamilyFacts facts;
  facts.name = absl::StrCat("families/", family.name);
  for (const mesh::FamilyTarget& target : family.targets) {
    facts.targets.push_back(absl::StrCat("animations/", target.name));
  }
  facts.duration_s = family.duration_s();
  facts.frames_per_second = family.frames_per_second;
  facts.num_levels = 1 + static_cast<int>(family.coarser_levels.size());
  facts.up = static_cast<Up>(family.up);  // the same numbers
  facts.bounds = BoundsOf(family);
  facts.parameter_space.names = family.parameter_space.names;
  facts.parameter_space.points = family.parameter_space.points;
  return facts;
}

absl::StatusOr<frames::BlendWeights> WeightsOf(const frames::IndexedFamily& indexed,
                                               const BlendSpec& blend) {
  if (blend.parameters.empty()) {
    LB_RETURN_IF_ERROR(frames::CheckWeights(indexed, blend.weights));
    return frames::ClampWeights(indexed, blend.weights);
  }
  std::vector<frames::Parameter> point;
  for (const auto& [name, value] : blend.parameters) point.push_back({name, value});
  return frames::WeightsOfPoint(indexed, point, blend.extrapolate);
}

absl::StatusOr<frames::SurfaceOptions> OptionsOf(const frames::IndexedFamily& indexed,
                                                 const SurfaceOptions& surface) {
  const int num_levels = static_cast<int>(indexed.levels.size());
  if (surface.level_of_detail < 0 || surface.level_of_detail >= num_levels) {
    return absl::InvalidArgumentError(absl::StrCat(
        "level_of_detail must be in [0, ", num_levels - 1, "], got ", surface.level_of_detail));
  }
  frames::SurfaceOptions options;
  options.level_of_detail = surface.level_of_detail;
  options.smoothing.passes = surface.smoothing_passes;
  if (surface.smoothing == Smoothing::kLaplacian) {
    options.smoothing.kind = finish::SmoothingKind::kLaplacian;
  }
  if (surface.smoothing_strength != 0.0) options.smoothing.strength = surface.smoothing_strength;
  options.temporal_smoothing = surface.temporal_smoothing;
  options.normals = surface.normals;
  options.velocities = surface.velocities;
  options.rest_positions = surface.rest_positions;
  LB_RETURN_IF_ERROR(options.smoothing.Validate());
  LB_RETURN_IF_ERROR(
      frames::TemporalOptionsOf(indexed.family, options.temporal_smoothing).Validate());
  return options;
}

absl::StatusOr<frames::RoundingOptions> RoundingOf(const frames::IndexedFamily& indexed,
                                                   int position_bits) {
  frames::RoundingOptions options;
  options.grid = indexed.grid;
  options.duration_s = indexed.family.duration_s();
  if (position_bits != 0) options.position_bits = position_bits;
  if (options.position_bits < frames::kMinPositionBits ||
      options.position_bits > frames::kMaxRoundedBits) {
    return absl::InvalidArgumentError(
        absl::StrCat("position_bits must be in [", frames::kMinPositionBits, ", ",
                     frames::kMaxRoundedBits, "], got ", options.position_bits));
  }
  return options;
}

client::PackedMesh PackedOf(const frames::RoundedSurface& surface) {
  return {.positions = surface.positions,
          .triangles = surface.triangles,
          .normals = surface.normals,
          .velocities = surface.velocities,
          .rest = surface.rest,
          .origin_m = surface.origin_m,
          .step_m = surface.step_m,
          .velocity_step_m_s = surface.velocity_step_m_s,
          .rest_origin_m = surface.origin_m,
          .rest_step_m = surface.rest_step_m,
          .rest_step_s = surface.rest_step_s};
}

absl::Status Fill(const frames::RoundedSurface& surface, FramePool& pool, FrameMesh& out) {
  const client::PackedMesh packed = PackedOf(surface);
  const Attributes attributes = {!packed.normals.empty(), !packed.velocities.empty(),
                                 !packed.rest.empty()};
  LB_RETURN_IF_ERROR(
      out.Resize(packed.positions.size(), packed.triangles.size(), attributes, pool));
  client::Unpack(packed, out.memory());
  out.UpdateBounds();
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<std::unique_ptr<FileSource>> FileSource::Open(const std::string& path) {
  LB_ASSIGN_OR_RETURN(std::shared_ptr<const store::Blob> file, Map(path));
  LB_ASSIGN_OR_RETURN(mesh::RegisteredFamily family, store::OpenFamily(file, path));
  auto space = frames::MakeOptionalSpace(family.parameter_space);
  LB_RETURN_IF_ERROR(space.status());
  return std::unique_ptr<FileSource>(
      new FileSource(std::move(file), std::move(family), *std::move(space)));
}

FileSource::FileSource(std::shared_ptr<const store::Blob> file, mesh::RegisteredFamily family,
                       frames::OptionalSpace space)
    : file_(std::move(file)),
      indexed_(std::move(family), std::move(space)),
      facts_(FactsOf(indexed_.family)) {}

absl::Status FileSource::Get(const FrameSpec& spec, FramePool& pool, FrameMesh& out,
                             FrameCost& cost) {
  const Clock::time_point start = Clock::now();
  LB_ASSIGN_OR_RETURN(const frames::SurfaceOptions options, OptionsOf(indexed_, spec.surface));
  LB_ASSIGN_OR_RETURN(const frames::RoundingOptions rounding,
                      RoundingOf(indexed_, spec.position_bits));
  LB_ASSIGN_OR_RETURN(frames::BlendWeights blend, WeightsOf(indexed_, spec.blend));
  std::unique_ptr<frames::SurfaceBuffers> buffers = buffers_.Take();
  const absl::Cleanup give_back = [&] { buffers_.GiveBack(std::move(buffers)); };
  LB_ASSIGN_OR_RETURN(const mesh::TriangleMesh surface,
                      frames::MakeSurface(
                          indexed_, blend.weights, spec.time_s, options,
                          [this] { return file_->Check(); }, *buffers));
  LB_RETURN_IF_ERROR(Fill(frames::RoundSurface(surface, rounding), pool, out));
  out.facts = {std::move(blend.weights), spec.time_s,           facts_.version,
               options.level_of_detail,  blend.is_extrapolated, blend.is_clamped};
  cost = {.decode_s = std::chrono::duration<double>(Clock::now() - start).count()};
  return absl::OkStatus();
}

}  // namespace liquidblend::player
