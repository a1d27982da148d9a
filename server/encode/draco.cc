#include "server/encode/draco.h"

#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/encode/libdraco.h"

namespace liquidblend::encode {
namespace {

// Options with which the writer makes the same as libdraco at the preset's speed, 7 or 4.
SurfaceWriterOptions WriterOptionsOf(const DracoOptions& options) {
  const bool is_fastest = options.preset == Preset::kFastest;
  SurfaceWriterOptions writer;
  writer.method = is_fastest ? EdgebreakerMethod::kStandard : EdgebreakerMethod::kValence;
  writer.positions.grid = options.grid;
  writer.positions.bits = options.position_bits;
  writer.positions.extra_precision = is_fastest ? -2 : 0;
  return writer;
}

}  // namespace

absl::Status DracoOptions::Validate() const {
  if (position_bits < frames::kMinPositionBits || position_bits > frames::kMaxPositionBits) {
    return absl::InvalidArgumentError(absl::StrCat("position_bits is ", position_bits, ", not in [",
                                                   frames::kMinPositionBits, ", ",
                                                   frames::kMaxPositionBits, "]"));
  }
  for (int k = 0; k < 3; ++k) {
    if (!std::isfinite(grid.origin[k]) || !std::isfinite(grid.origin[k] + grid.extent_m)) {
      return absl::InvalidArgumentError(absl::StrCat("grid.origin[", k, "] is ", grid.origin[k],
                                                     " at an extent of ", grid.extent_m,
                                                     ": not finite"));
    }
  }
  if (!(grid.extent_m > 0.0F)) {
    return absl::InvalidArgumentError(
        absl::StrCat("grid.extent_m is ", grid.extent_m, ", not greater than 0"));
  }
  return absl::OkStatus();
}

absl::StatusOr<std::string> EncodeDraco(const mesh::TriangleMesh& mesh, const DracoOptions& options,
                                        SurfaceWriter& writer, parallel::Helpers* helpers) {
  LB_RETURN_IF_ERROR(options.Validate());
  LB_RETURN_IF_ERROR(mesh::Validate(mesh));
  const bool is_positions_only =
      mesh.normals.cols() == 0 && mesh.velocities.cols() == 0 && mesh.rest.cols() == 0;
  std::string data;
  const bool is_written =
      is_positions_only && writer.Write(mesh, WriterOptionsOf(options), data, helpers);
  if (is_written && options.preset != Preset::kSmallest) return data;
  LB_ASSIGN_OR_RETURN(std::string by_libdraco, EncodeWithLibdraco(mesh, options));
  return is_written && data.size() < by_libdraco.size() ? data : by_libdraco;
}

absl::StatusOr<std::string> EncodeDraco(const mesh::TriangleMesh& mesh,
                                        const DracoOptions& options) {
  SurfaceWriter writer;
  return EncodeDraco(mesh, options, writer);
}

}  // namespace liquidblend::encode
