#include "core/mesh/registered_family.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/mesh/option_ranges.h"

namespace liquidblend::mesh {
namespace {

constexpr double kMostFramesPerSecond = 1e9;  // that a time axis of squares can count

static_assert(sizeof(Float4) == 16, "a column of Matrix4Xf is a Float4");
static_assert(sizeof(Float3) == 12, "a column of Matrix3Xf is a Float3");

absl::Status Fault(const RegisteredFamily& family, absl::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat("family ", family.name, ": ", what));
}

absl::Status CheckNumbers(const RegisteredFamily& family) {
  if (family.vertices.size() > static_cast<size_t>(std::numeric_limits<int32_t>::max())) {
    return Fault(family, absl::StrCat("too many vertices: ", family.vertices.size()));
  }
  if (family.num_frames < 1) return Fault(family, absl::StrCat("num_frames = ", family.num_frames));
  if (family.num_pre_roll < 0) {
    return Fault(family, absl::StrCat("num_pre_roll = ", family.num_pre_roll));
  }
  if (!std::isfinite(family.frames_per_second) || family.frames_per_second <= 0.0) {
    return Fault(family, absl::StrCat("frames_per_second = ", family.frames_per_second));
  }
  if (family.rest_time_s && !kRestTimeS.Holds(*family.rest_time_s)) {
    return Fault(family, absl::StrCat("rest_time_s = ", *family.rest_time_s));
  }
  if (family.rest_time_s && family.frames_per_second > kMostFramesPerSecond) {
    return Fault(family, absl::StrCat("a rest time with frames_per_second = ",
                                      family.frames_per_second));  // its square would overflow
  }
  if (!std::isfinite(family.edge_length_m) || family.edge_length_m < 0.0) {
    return Fault(family, absl::StrCat("edge_length_m = ", family.edge_length_m));
  }
  for (int axis = 0; axis < 3; ++axis) {
    const float low = family.domain_min[axis];
    const float high = family.domain_max[axis];
    if (std::isfinite(low) && std::isfinite(high) && low <= high) continue;
    return Fault(family, absl::StrCat("domain from ", low, " to ", high, " along axis ", axis));
  }
  return absl::OkStatus();
}

template <typename Values>
absl::Status CheckFinite(const RegisteredFamily& family, const std::string& what,
                         std::span<const Values> values) {
  for (size_t v = 0; v < values.size(); ++v) {
    if (std::all_of(values[v].begin(), values[v].end(), [](float x) { return std::isfinite(x); })) {
      continue;
    }
    return Fault(family, absl::StrCat(what, " ", v, " is not finite"));
  }
  return absl::OkStatus();
}

absl::Status CheckVelocities(const RegisteredFamily& family) {
  if (!family.velocities.empty() && family.velocities.size() != family.vertices.size()) {
    return Fault(family, absl::StrCat(family.velocities.size(), " velocities for ",
                                      family.vertices.size(), " vertices"));
  }
  return CheckFinite(family, "velocity", family.velocities);
}

absl::Status CheckEndSlabs(const RegisteredFamily& family) {
  const int64_t first = family.num_first_vertices;
  const int64_t last = family.num_last_vertices;
  const int64_t count = static_cast<int64_t>(family.vertices.size());
  if (first < 0 || last < 0 || first > count || last > count - first) {
    return Fault(family, absl::StrCat(first, " vertices in the first and ", last,
                                      " in the last slab, of ", count));
  }
  for (int64_t v = 0; v < first; ++v) {
    if (family.vertices[v][3] < 0.0f) continue;
    return Fault(family, absl::StrCat("vertex ", v, " of the first slab has time ",
                                      family.vertices[v][3], ", not before frame 0"));
  }
  for (int64_t v = count - last; v < count; ++v) {
    if (family.vertices[v][3] > static_cast<float>(family.num_frames - 1)) continue;
    return Fault(family,
                 absl::StrCat("vertex ", v, " of the last slab has time ", family.vertices[v][3],
                              ", not after frame ", family.num_frames - 1));
  }
  return absl::OkStatus();
}

template <typename Cell>
absl::Status CheckCells(const RegisteredFamily& family, const char* kind,
                        std::span<const Cell> cells) {
  const auto count = static_cast<uint32_t>(family.vertices.size());
  for (size_t i = 0; i < cells.size(); ++i) {
    for (const int32_t v : cells[i]) {
      if (static_cast<uint32_t>(v) < count) continue;
      return Fault(family, absl::StrCat(kind, " ", i, " has vertex ", v, ", of ", count));
    }
  }
  return absl::OkStatus();
}

absl::Status CheckPartLives(const RegisteredFamily& family, const FamilyTarget& target) {
  for (const PartLife& life : target.report.part_lives) {
    LB_RETURN_IF_ERROR(CheckFinite(family, absl::StrCat("target ", target.name, ": start of part"),
                                   std::span(&life.source_start_m, 1)));
    for (const double end : {life.source_end_frames, life.target_end_frames}) {
      if (end >= 0.0 && std::isfinite(end)) continue;
      return Fault(family, absl::StrCat("target ", target.name, ": a part ends at frame ", end));
    }
  }
  return absl::OkStatus();
}

absl::Status CheckTarget(const RegisteredFamily& family, const FamilyTarget& target) {
  const size_t count = family.vertices.size();
  if (target.displacement.size() != count) {
    return Fault(family, absl::StrCat("target ", target.name, " displaces ",
                                      target.displacement.size(), " of ", count, " vertices"));
  }
  if (!target.extrapolation.empty() && target.extrapolation.size() != count) {
    return Fault(family, absl::StrCat("target ", target.name, " extrapolates ",
                                      target.extrapolation.size(), " of ", count, " vertices"));
  }
  LB_RETURN_IF_ERROR(CheckFinite(family, absl::StrCat("target ", target.name, ": displacement"),
                                 target.displacement));
  LB_RETURN_IF_ERROR(CheckPartLives(family, target));
  return CheckFinite(family, absl::StrCat("target ", target.name, ": extrapolation"),
                     target.extrapolation);
}

absl::Status CheckLevel(const RegisteredFamily& family, size_t k) {
  const RegisteredFamily& level = family.coarser_levels[k];
  const bool is_alike =
      level.targets.size() == family.targets.size() && level.num_frames == family.num_frames &&
      level.num_pre_roll == family.num_pre_roll &&
      level.frames_per_second == family.frames_per_second &&
      level.rest_time_s == family.rest_time_s && level.domain_min == family.domain_min &&
      level.domain_max == family.domain_max && level.coarser_levels.empty();
  if (!is_alike) {
    return Fault(
        family,
        absl::StrCat("level of detail ", k + 1,
                     " has other targets, frames, domain, rest time, or levels of its own"));
  }
  const absl::Status status = Validate(level);
  if (status.ok()) return status;
  return Fault(family,
               absl::StrCat("level of detail ", k + 1, ": ", std::string(status.message())));
}

absl::Status CheckReports(const RegisteredFamily& family) {
  const size_t count = family.space_time_reports.size();
  if (count == 0 || count == 1 + family.targets.size()) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(count, " reports of space-time meshes for ",
                                                 1 + family.targets.size(), " animations"));
}

absl::Status CheckParameters(const RegisteredFamily& family) {
  const auto num_animations = static_cast<int>(1 + family.targets.size());
  const absl::Status status = Validate(family.parameter_space, num_animations);
  if (status.ok()) return status;
  return Fault(family, absl::StrCat("parameter space: ", std::string(status.message())));
}

}  // namespace

absl::Status Validate(const RegisteredFamily& family) {
  LB_RETURN_IF_ERROR(CheckNumbers(family));
  LB_RETURN_IF_ERROR(CheckFinite(family, "vertex", family.vertices));
  LB_RETURN_IF_ERROR(CheckVelocities(family));
  LB_RETURN_IF_ERROR(CheckEndSlabs(family));
  LB_RETURN_IF_ERROR(CheckCells(family, "tetrahedron", family.tetrahedra));
  LB_RETURN_IF_ERROR(CheckCells(family, "pyramid", family.pyramids));
  LB_RETURN_IF_ERROR(CheckCells(family, "wedge", family.wedges));
  LB_RETURN_IF_ERROR(CheckCells(family, "hexahedron", family.hexahedra));
  for (const FamilyTarget& target : family.targets) {
    LB_RETURN_IF_ERROR(CheckTarget(family, target));
  }
  LB_RETURN_IF_ERROR(CheckReports(family));
  LB_RETURN_IF_ERROR(CheckParameters(family));
  for (size_t k = 0; k < family.coarser_levels.size(); ++k) {
    LB_RETURN_IF_ERROR(CheckLevel(family, k));
  }
  return absl::OkStatus();
}

RegisteredFamily ViewOf(const SpaceTimeMesh& mesh) {
  RegisteredFamily family;
  family.vertices = {reinterpret_cast<const Float4*>(mesh.vertices.data()),
                     static_cast<size_t>(mesh.num_vertices())};
  family.velocities = {reinterpret_cast<const Float3*>(mesh.velocities.data()),
                       static_cast<size_t>(mesh.velocities.cols())};
  family.tetrahedra = mesh.tetrahedra;
  family.pyramids = mesh.pyramids;
  family.wedges = mesh.wedges;
  family.hexahedra = mesh.hexahedra;
  family.num_first_vertices = mesh.num_first_vertices;
  family.num_last_vertices = mesh.num_last_vertices;
  family.num_frames = mesh.num_frames;
  family.num_pre_roll = mesh.num_pre_roll;
  family.frames_per_second = mesh.frames_per_second;
  family.up = mesh.up;
  family.edge_length_m = mesh.edge_length_m;
  if (mesh.num_vertices() > 0) {
    Eigen::Map<Eigen::Vector3f>(family.domain_min.data()) =
        mesh.vertices.topRows<3>().rowwise().minCoeff();
    Eigen::Map<Eigen::Vector3f>(family.domain_max.data()) =
        mesh.vertices.topRows<3>().rowwise().maxCoeff();
  }
  return family;
}

}  // namespace liquidblend::mesh
