#include "server/frames/animation_frame.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/finish/normals.h"
#include "server/base/errors.h"
#include "server/base/names.h"
#include "server/encode/draco.h"
#include "server/encode/mesh_files.h"
#include "server/encode/meshopt.h"
#include "server/encode/simplify.h"
#include "server/frames/encoding.h"
#include "server/frames/make_frame.h"

namespace liquidblend::server {
namespace {

using store::v1::AnimationManifest;

constexpr int64_t kCellsPerTriangle = 8;  // libdraco, which writes most of these frames

bool Wants(const v1::GetAnimationFrameRequest& request, int attribute) {
  return std::find(request.attributes().begin(), request.attributes().end(), attribute) !=
         request.attributes().end();
}

// Around all frames.
frames::Grid GridOf(const AnimationManifest& manifest) {
  frames::Grid grid;
  if (manifest.bounds().min_size() != 3 || manifest.bounds().max_size() != 3) return grid;
  float extent = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto low = static_cast<float>(manifest.bounds().min(axis));
    grid.origin[static_cast<size_t>(axis)] = low;
    extent = std::max(extent, static_cast<float>(manifest.bounds().max(axis)) - low);
  }
  if (extent > 0) grid.extent_m = extent;
  return grid;
}

double TimeOf(const AnimationManifest& manifest, int k) {
  const double frames = manifest.times().empty() ? k : manifest.times(k);
  return frames / manifest.frames_per_second();
}

int NearestFrame(const AnimationManifest& manifest, double time_s) {
  int nearest = 0;
  for (int k = 1; k < manifest.num_frames(); ++k) {
    const bool is_nearer =
        std::abs(TimeOf(manifest, k) - time_s) < std::abs(TimeOf(manifest, nearest) - time_s);
    if (is_nearer) nearest = k;
  }
  return nearest;
}

absl::StatusOr<std::string> Encoded(const AnimationManifest& manifest, const v1::Encoding& encoding,
                                    const mesh::TriangleMesh& frame) {
  if (encoding.format() == v1::Encoding::PLY) return encode::EncodePly(frame);
  if (encoding.format() == v1::Encoding::OBJ) return encode::EncodeObj(frame);
  if (encoding.format() == v1::Encoding::MESHOPT) {
    return encode::EncodeMeshopt(frame, RoundingOptionsOf(GridOf(manifest), 0.0, encoding));
  }
  return encode::EncodeDraco(frame, DracoOptionsOf(GridOf(manifest), encoding));
}

}  // namespace

absl::StatusOr<int> FindAnimationFrame(const AnimationManifest& manifest,
                                       const v1::GetAnimationFrameRequest& request) {
  const int last = manifest.num_frames() - 1;
  if (last < 0) return absl::FailedPreconditionError("the animation has no frames");
  if (request.has_frame_number()) {
    const int64_t k = int64_t{request.frame_number()} - manifest.first_frame_number();
    if (k >= 0 && k <= last) return static_cast<int>(k);
    return AtField("frame_number",
                   absl::OutOfRangeError(absl::StrCat("must be in [", manifest.first_frame_number(),
                                                      ", ", manifest.first_frame_number() + last,
                                                      "], got ", request.frame_number())));
  }
  if (!request.has_time_s()) return 0;
  const double duration_s = TimeOf(manifest, last);
  if (request.time_s() >= 0 && request.time_s() <= duration_s) {
    return NearestFrame(manifest, request.time_s());
  }
  return AtField("time_s", absl::OutOfRangeError(absl::StrCat("must be in [0, ", duration_s,
                                                              "], got ", request.time_s())));
}

absl::Status CheckAnimationFrame(const AnimationManifest& manifest,
                                 const v1::GetAnimationFrameRequest& request) {
  FieldViolations violations;
  const int level = request.level_of_detail();
  violations.AddIf(level < 0 || level > kMaxAnimationLevel, "level_of_detail",
                   absl::StrCat("must be in [0, ", kMaxAnimationLevel, "], got ", level));
  CheckEncoding(GridOf(manifest), "this animation", request.encoding(), violations);
  for (const int attribute : request.attributes()) {
    violations.AddIf(attribute == v1::SurfaceOptions::REST_POSITIONS, "attributes",
                     "only frames of families have rest positions");
    violations.AddIf(attribute == v1::SurfaceOptions::ATTRIBUTE_UNSPECIFIED ||
                         !v1::SurfaceOptions::Attribute_IsValid(attribute),
                     "attributes", absl::StrCat("unknown attribute ", attribute));
  }
  violations.AddIf(request.encoding().format() == v1::Encoding::OBJ &&
                       Wants(request, v1::SurfaceOptions::VELOCITIES),
                   "attributes", "OBJ holds no velocities; ask for PLY");
  return violations.ToStatus();
}

int64_t CostOfAnimationFrame(const mesh::TriangleMesh& frame) {
  return kCellsPerTriangle * frame.num_triangles();
}

absl::StatusOr<v1::AnimationFrame> EncodeAnimationFrame(
    const AnimationManifest& manifest, int k, mesh::TriangleMesh frame,
    const v1::GetAnimationFrameRequest& request) {
  const bool wants_velocities = Wants(request, v1::SurfaceOptions::VELOCITIES);
  if (wants_velocities && frame.velocities.cols() == 0 && frame.num_vertices() > 0) {
    return InvalidField("attributes", "this animation has no velocities");
  }
  if (!wants_velocities) frame.velocities.resize(3, 0);
  const int level = request.level_of_detail();
  if (level > 0) frame = encode::Simplify(frame, std::exp2(-level));
  if (Wants(request, v1::SurfaceOptions::NORMALS)) finish::AddNormals(frame);
  v1::AnimationFrame result;
  LB_ASSIGN_OR_RETURN(*result.mutable_data(), Encoded(manifest, request.encoding(), frame));
  result.set_frame_number(manifest.first_frame_number() + k);
  result.set_time_s(TimeOf(manifest, k));
  result.set_num_vertices(frame.num_vertices());
  result.set_num_triangles(frame.num_triangles());
  if (frame.num_vertices() > 0) SetBounds(frame, *result.mutable_bounds());
  return result;
}

}  // namespace liquidblend::server
