#include "server/frames/measure.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/blend/blend.h"
#include "core/slice/slice.h"
#include "server/base/errors.h"

namespace liquidblend::server {
namespace {

using catalog::LoadedFamily;
using Eigen::Vector3d;
using Residual = v1::MeasureCorrespondencesResponse::Residual;

constexpr int kMaxPlaces = 64;  // of a SPACE correspondence

Vector3d VectorOf(const v1::Vector3& vector) { return {vector.x(), vector.y(), vector.z()}; }

// Barycentric coordinates of the point of a triangle that is closest to p (Ericson, Real-Time
// Collision Detection, 5.1.5).
Vector3d ClosestOfTriangle(const Vector3d& p, const Vector3d& a, const Vector3d& b,
                           const Vector3d& c) {
  const Vector3d ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return {1 - d1 / (d1 - d3), d1 / (d1 - d3), 0};
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return {1 - d2 / (d2 - d6), 0, d2 / (d2 - d6)};
  const double va = d3 * d6 - d5 * d4;
  const double along = (d4 - d3) / ((d4 - d3) + (d5 - d6));
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) return {0, 1 - along, along};
  const double sum = va + vb + vc;
  return {va / sum, vb / sum, vc / sum};
}

// A point of a surface.
struct SurfacePoint {
  double distance_m = std::numeric_limits<double>::infinity();  // from what was looked for
  Eigen::Vector3i corners = Eigen::Vector3i::Zero();
  Vector3d coordinates = Vector3d::Zero();
};

SurfacePoint NearestOf(const mesh::TriangleMesh& surface, const Vector3d& place) {
  SurfacePoint nearest;
  for (Eigen::Index t = 0; t < surface.triangles.cols(); ++t) {
    const Eigen::Vector3i corners = surface.triangles.col(t);
    const Eigen::Matrix3d triangle = surface.vertices(Eigen::all, corners).cast<double>();
    const Vector3d coordinates =
        ClosestOfTriangle(place, triangle.col(0), triangle.col(1), triangle.col(2));
    const double distance_m = (triangle * coordinates - place).norm();
    if (distance_m < nearest.distance_m) nearest = {distance_m, corners, coordinates};
  }
  return nearest;
}

// The surface at weights and a time, with its workspace.
class Slice {
 public:
  // Requires: the time is one of the animation.
  Slice(const LoadedFamily& loaded, const std::vector<double>& weights, double time_s)
      : family_(loaded.family) {
    const frames::IndexedLevel& level = *loaded.levels[0];
    if (!slice::FindCandidates(level.index, weights, time_s, workspace_).ok()) return;
    const blend::Blender blender(family_, weights);
    surface_ = slice::March(level.index, blender, workspace_);
  }

  SurfacePoint Nearest(const Vector3d& place) const { return NearestOf(surface_, place); }

  // The displacement there, of a target: metres and ticks. Requires: weights are 0.
  Eigen::Vector4d DisplacementAt(const SurfacePoint& point,
                                 const mesh::FamilyTarget& target) const {
    Eigen::Vector4d sum = Eigen::Vector4d::Zero();
    for (int i = 0; i < 3; ++i) {
      if (point.coordinates[i] == 0) continue;
      sum += point.coordinates[i] * DisplacementOf(static_cast<size_t>(point.corners[i]), target);
    }
    return sum;
  }

 private:
  Eigen::Vector4d DisplacementOf(size_t vertex, const mesh::FamilyTarget& target) const {
    const auto near = static_cast<size_t>(workspace_.near_vertex[vertex]);
    const auto far = static_cast<size_t>(workspace_.far_vertex[vertex]);
    const double from = family_.vertices[near][3], to = family_.vertices[far][3];
    const double share = from == to ? 0 : (workspace_.time_ticks - from) / (to - from);
    const auto at = [&](size_t v) {
      return Eigen::Map<const Eigen::Vector4f>(target.displacement[v].data()).cast<double>().eval();
    };
    return (1 - share) * at(near) + share * at(far);
  }

  const mesh::RegisteredFamily& family_;
  slice::Workspace workspace_;
  mesh::TriangleMesh surface_;
};

void CheckEvent(const v1::Event& event, const std::string& field, double duration_s,
                FieldViolations& violations) {
  violations.AddIf(!VectorOf(event.position()).allFinite(), absl::StrCat(field, ".position"),
                   "must be finite");
  violations.AddIf(!(event.time_s() >= 0 && event.time_s() <= duration_s),
                   absl::StrCat(field, ".time_s"),
                   absl::StrCat("must be in [0, ", duration_s, "], got ", event.time_s()));
}

// Times of the source at which a correspondence is measured.
std::vector<double> TimesOf(const mesh::RegisteredFamily& family, const v1::Correspondence& pair) {
  std::vector<double> times = {pair.source().time_s()};
  if (pair.kind() != v1::Correspondence::SPACE) return times;
  const double end = pair.length_s() > 0
                         ? std::min(pair.source().time_s() + pair.length_s(), family.duration_s())
                         : family.duration_s();
  const double step =
      std::max(1 / family.frames_per_second, (end - pair.source().time_s()) / (kMaxPlaces - 1));
  while (times.back() + step <= end && static_cast<int>(times.size()) < kMaxPlaces) {
    times.push_back(times.back() + step);
  }
  return times;
}

// Adds what is measured at one time of the source.
void MeasureAt(const LoadedFamily& loaded, const mesh::FamilyTarget& target,
               const v1::Correspondence& pair, double time_s, Residual& residual) {
  const mesh::RegisteredFamily& family = loaded.family;
  const Slice source(loaded, std::vector<double>(family.targets.size()), time_s);
  const Vector3d place = VectorOf(pair.source().position());
  const SurfacePoint nearest = source.Nearest(place);
  const Eigen::Vector4d moved = source.DisplacementAt(nearest, target);
  const mesh::TimeAxis axis = family.time_axis();
  const double fps = family.frames_per_second;
  const double frames = axis.Frames(axis.Ticks(time_s * fps) + moved[3]);
  const bool has_time = pair.kind() != v1::Correspondence::SPACE;
  const double off_m = (place + moved.head<3>() - VectorOf(pair.target().position())).norm();
  const double off_frames = has_time ? std::abs(frames - pair.target().time_s() * fps) : 0.0;
  residual.set_residual_m(std::max(residual.residual_m(), off_m));
  residual.set_residual_frames(std::max(residual.residual_frames(), off_frames));
  residual.set_residual_edges(
      std::max(residual.residual_edges(), std::hypot(off_m / family.edge_length_m, off_frames)));
  if (time_s == pair.source().time_s()) residual.set_source_distance_m(nearest.distance_m);
}

}  // namespace

absl::Status CheckMeasurement(const LoadedFamily& loaded,
                              const v1::MeasureCorrespondencesRequest& request) {
  FieldViolations violations;
  const auto num_targets = static_cast<int>(loaded.family.targets.size());
  violations.AddIf(
      request.target_index() < 0 || request.target_index() >= num_targets, "target_index",
      absl::StrCat("must be in [0, ", num_targets - 1, "], got ", request.target_index()));
  const int size = request.correspondences_size();
  violations.AddIf(size < 1 || size > kMaxMeasured, "correspondences",
                   absl::StrCat("must be 1 to ", kMaxMeasured, ", got ", size));
  const double duration_s = loaded.family.duration_s();
  for (int k = 0; k < std::min(size, kMaxMeasured); ++k) {
    const v1::Correspondence& pair = request.correspondences(k);
    const std::string field = absl::StrCat("correspondences[", k, "]");
    CheckEvent(pair.source(), field + ".source", duration_s, violations);
    CheckEvent(pair.target(), field + ".target", duration_s, violations);
    violations.AddIf(!v1::Correspondence::Kind_IsValid(pair.kind()), field + ".kind",
                     absl::StrCat("unknown kind ", pair.kind()));
    violations.AddIf(!(pair.length_s() >= 0) || std::isinf(pair.length_s()), field + ".length_s",
                     absl::StrCat("must be 0 or more, got ", pair.length_s()));
  }
  return violations.ToStatus();
}

Measurement::Measurement(catalog::FamilyPtr loaded, v1::MeasureCorrespondencesRequest request)
    : loaded_(std::move(loaded)), request_(std::move(request)) {
  BeginPair();
}

void Measurement::BeginPair() {
  if (is_over()) return;
  times_s_ = TimesOf(loaded_->family, request_.correspondences(pair_));
  num_measured_ = 0;
  response_.add_residuals();
}

int64_t Measurement::StepCost() const {
  const mesh::RegisteredFamily& family = loaded_->family;
  return family.num_cells() / std::max(1, family.num_frames) + 1;
}

void Measurement::Step() {
  const v1::Correspondence& pair = request_.correspondences(pair_);
  Residual& residual = *response_.mutable_residuals(pair_);
  const auto index = static_cast<size_t>(request_.target_index());
  if (num_measured_ < times_s_.size()) {
    MeasureAt(*loaded_, loaded_->family.targets[index], pair, times_s_[num_measured_++], residual);
    return;
  }
  std::vector<double> weights(loaded_->family.targets.size());
  weights[index] = 1.0;
  const Slice shown(*loaded_, weights, pair.target().time_s());
  residual.set_target_distance_m(shown.Nearest(VectorOf(pair.target().position())).distance_m);
  ++pair_;
  BeginPair();
}

absl::StatusOr<v1::MeasureCorrespondencesResponse> Measurement::TakeResponse() {
  LB_RETURN_IF_ERROR(loaded_->CheckFile());
  return std::move(response_);
}

}  // namespace liquidblend::server
