#include "client/cli/flags/surface_flags.h"

#include <algorithm>
#include <iterator>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"

#include "client/cli/flags/number_checks.h"

namespace liquidblend::cli {

void AddSurfaceFlags(CLI::App& command, SurfaceFlags& flags) {
  SurfaceOptions& options = flags.options;
  command
      .add_option("--lod", options.level_of_detail,
                  "Level of detail; 0 the finest, each next has about half the vertices")
      ->check(NonNegative())
      ->capture_default_str();
  command
      .add_option("--smooth", options.smoothing_passes,
                  "Passes that even out triangles; volumes stay (Taubin)")
      ->check(CLI::Range(0, 32))
      ->capture_default_str();
  command.add_flag("--laplacian", flags.laplacian,
                   "With --smooth: passes of the paper's kind, which shrink what is small");
  command
      .add_option("--smooth-strength", options.smoothing_strength,
                  "How far a pass goes, above 0 to 1; default 0.5")
      ->check(CLI::Range(0.0, 1.0));
  command
      .add_option("--smooth-time", options.temporal_smoothing,
                  "0 to 1: mix with a little earlier and later, against flicker")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  command.add_flag("--normals", options.normals,
                   "Also normals (.ply: nx ny nz; .drc; gltf, usda, vat)");
  command.add_flag("--velocities", options.velocities,
                   "Also velocities in m/s (.ply: vx vy vz; .drc; gltf, usda, vat, vdb)");
  command.add_flag("--rest-positions", options.rest_positions,
                   "Also places in the source, for textures that stick (.ply: rest_x rest_y rest_z "
                   "rest_t; .drc; gltf, usda)");
}

SurfaceOptions ToSurfaceOptions(const SurfaceFlags& flags) {
  SurfaceOptions options = flags.options;
  if (flags.laplacian) options.smoothing = Smoothing::kLaplacian;
  return options;
}

absl::Status CheckAttributes(const SurfaceFlags& flags, const std::string& extension) {
  const char* const holders[] = {"ply", "drc", "gltf", "usda", "vat"};
  const bool holds_vectors = std::count(std::begin(holders), std::end(holders), extension) > 0;
  const bool holds_rest = holds_vectors && extension != "vat";
  const std::pair<const char*, bool> lacking[] = {
      {"--normals", flags.options.normals && !holds_vectors},
      {"--velocities", flags.options.velocities && !holds_vectors && extension != "vdb"},
      {"--rest-positions", flags.options.rest_positions && !holds_rest}};
  for (const auto& [flag, is_lacking] : lacking) {
    if (!is_lacking) continue;
    const absl::string_view others =
        flag == lacking[0].first   ? ", and exports as gltf, usda and vat"
        : flag == lacking[1].first ? ", and exports as gltf, usda, vat and vdb"
                                   : ", and exports as gltf and usda";
    return absl::InvalidArgumentError(absl::StrCat(
        flag, ": .", extension, " files do not hold them; .ply and .drc do", std::string(others)));
  }
  return absl::OkStatus();
}

}  // namespace liquidblend::cli
