#include "worker/registration/fit/pins.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "worker/registration/surface/closest_point.h"

namespace liquidblend::registration {
namespace {

constexpr double kPinEveryFrames = 10;  // section 6, "typically every 10 frames"
constexpr double kOverruled = 3.0;      // edges; residual of a soft one that was not obeyed

// One animation's side of the correspondences.
struct Side {
  Side(const Surface& s, double edge_length_m, const char* side_name, const parallel::Arena& arena,
       float reach)
      : surface(s),
        edge(edge_length_m),
        name(side_name),
        on_surface(reach),
        tree(s.points, s.FreeVertices(), arena) {}
  const Surface& surface;
  double edge;  // metres per registration unit
  const char* name;
  float on_surface;  // registration units; points further off belong to no vertex
  PointTree tree;

  double last_frame() const { return surface.mesh.num_frames - 1; }
  Eigen::Vector4f ToUnits(const Eigen::Vector4d& event) const {
    Eigen::Vector4d point = event;
    point.head<3>() /= edge;
    return point.cast<float>();
  }
  int32_t NearestVertex(const Eigen::Vector4f& point) const {
    std::array<int32_t, 1> found = {0};
    tree.Nearest(point, found);
    return found[0];
  }
  // The same, if possible without the end slabs, whose vertices cannot be moved in time.
  int32_t NearestInnerVertex(const Eigen::Vector4f& point) const {
    std::array<int32_t, PointTree::kNumCandidates> found = {};
    const size_t count = tree.Nearest(point, found);
    for (size_t k = 0; k < count; ++k) {
      const bool at_end = surface.InFirstSlab(found[k]) || surface.InLastSlab(found[k]);
      if (!at_end && !surface.InPreRoll(found[k])) return found[k];
    }
    return found[0];
  }
  float DistanceTo(const Eigen::Vector4f& point) const {
    return (surface.points.col(NearestVertex(point)) - point).norm();
  }
  // Follows the velocity field for `frames` (section 6, trajectory).
  Eigen::Vector4f Trace(Eigen::Vector4f point, double frames) const {
    constexpr double kStep = 0.5;
    for (double done = 0; done < frames;) {
      const double step = std::min(kStep, frames - done);
      const Eigen::Vector3f velocity = surface.mesh.velocities.col(NearestVertex(point));
      const double units_per_frame = 1 / (surface.mesh.frames_per_second * edge);
      point.head<3>() += static_cast<float>(step * units_per_frame) * velocity;
      point[3] += static_cast<float>(step);
      done += step;
    }
    return point;
  }
};

absl::Status Check(size_t index, const Side& side, const Eigen::Vector4d& event,
                   CorrespondenceKind kind, bool on_surface) {
  const std::string where = absl::StrCat("correspondence ", index, ", ", side.name);
  if (!event.allFinite()) return absl::InvalidArgumentError(where + ": a number is not finite");
  if (event[3] < 0 || event[3] > side.last_frame()) {
    return absl::InvalidArgumentError(absl::StrCat(where, ": its time is frame ", event[3],
                                                   ", not in [0, ", side.last_frame(), "]"));
  }
  if (kind == CorrespondenceKind::kTrajectory && side.surface.mesh.velocities.cols() == 0) {
    return absl::InvalidArgumentError(
        where + ": a trajectory needs velocities, which the animation does not have");
  }
  const float distance = on_surface ? side.DistanceTo(side.ToUnits(event)) : 0.0f;
  if (!(distance <= side.on_surface)) {
    return absl::InvalidArgumentError(absl::StrCat(
        where, ": it lies ", distance, " mean edges (frames in time) off the surface",
        ", more than ", side.on_surface, "; droplets carried as rigid pieces do not count"));
  }
  return absl::OkStatus();
}

// Where a correspondence starts, and whether it holds in time.
Pin MakePin(const Correspondence& c, size_t index, const Side& source, const Eigen::Vector4f& from,
            const Eigen::Vector4f& to) {
  const bool in_time = c.kind != CorrespondenceKind::kSpace;
  const bool moves_in_time = in_time && from[3] != to[3];
  const int32_t v = moves_in_time ? source.NearestInnerVertex(from) : source.NearestVertex(from);
  return {v, to - from, c.hard, in_time, static_cast<int32_t>(index)};
}

void Expand(const Correspondence& c, size_t index, const Side& source, const Side& target,
            std::vector<Pin>& pins) {
  Eigen::Vector4f from = source.ToUnits(c.source), to = target.ToUnits(c.target);
  pins.push_back(MakePin(c, index, source, from, to));
  if (c.kind == CorrespondenceKind::kPoint) return;
  const bool traced = c.kind == CorrespondenceKind::kTrajectory;
  const double left =
      traced ? std::min(source.last_frame() - c.source[3], target.last_frame() - c.target[3])
             : source.last_frame() - c.source[3];
  const double length = c.length_frames > 0 ? std::min(c.length_frames, left) : left;
  for (double frames = kPinEveryFrames; frames <= length; frames += kPinEveryFrames) {
    if (traced) {
      from = source.Trace(from, kPinEveryFrames);
      to = target.Trace(to, kPinEveryFrames);
      if (!(target.DistanceTo(to) <= target.on_surface)) return;
    } else {
      from[3] += static_cast<float>(kPinEveryFrames);
      to[3] += static_cast<float>(kPinEveryFrames);
    }
    if (source.DistanceTo(from) <= source.on_surface) {
      pins.push_back(MakePin(c, index, source, from, to));
    } else if (traced) {
      return;
    }
  }
}

}  // namespace

absl::StatusOr<std::vector<Pin>> ExpandCorrespondences(
    const std::vector<Correspondence>& correspondences, const Surface& source,
    const Surface& target, const parallel::Arena& arena, float on_surface) {
  std::vector<Pin> pins;
  if (correspondences.empty()) return pins;
  const double edge = source.mesh.edge_length_m;
  const Side from(source, edge, "source", arena, on_surface);
  const Side to(target, edge, "target", arena, on_surface);
  for (size_t n = 0; n < correspondences.size(); ++n) {
    const Correspondence& c = correspondences[n];
    const bool in_time = c.kind != CorrespondenceKind::kSpace;  // else it may get there any time
    LB_RETURN_IF_ERROR(Check(n, from, c.source, c.kind, /*on_surface=*/true));
    LB_RETURN_IF_ERROR(Check(n, to, c.target, c.kind, /*on_surface=*/in_time));
    if (!(c.length_frames >= 0) || !std::isfinite(c.length_frames)) {
      return absl::InvalidArgumentError(absl::StrCat("correspondence ", n, ": its length is ",
                                                     c.length_frames, " frames, not >= 0"));
    }
    Expand(c, n, from, to, pins);
  }
  return pins;
}

void OverrideClosestPoints(const std::vector<Pin>& pins, double weight, int64_t num_nodes,
                           std::vector<FitTerm>& terms) {
  std::set<int32_t> overridden;
  for (const Pin& pin : pins) {
    if (!pin.hard) overridden.insert(pin.vertex);
  }
  if (overridden.empty()) return;
  std::erase_if(terms, [&](const FitTerm& term) { return overridden.count(term.vertex) != 0; });
  // Minimize() divides by the number of terms per node.
  const double scale = static_cast<double>(std::max<size_t>(1, terms.size())) /
                       static_cast<double>(std::max<int64_t>(1, num_nodes));
  for (const Pin& pin : pins) {
    if (pin.hard) continue;
    Eigen::Vector4f diagonal = Eigen::Vector4f::Constant(static_cast<float>(weight * scale));
    if (!pin.in_time) diagonal[3] = 0;
    terms.push_back({pin.vertex, pin.goal, diagonal.asDiagonal()});
  }
}

std::vector<CorrespondenceReport> ReportCorrespondences(
    const std::vector<Correspondence>& correspondences, const std::vector<Pin>& pins,
    const Points& displacement, double edge_length_m) {
  std::vector<CorrespondenceReport> reports(correspondences.size());
  for (size_t n = 0; n < reports.size(); ++n) reports[n].correspondence = correspondences[n];
  for (const Pin& pin : pins) {
    CorrespondenceReport& report = reports[pin.correspondence];
    const Eigen::Vector4f miss = displacement.col(pin.vertex) - pin.goal;
    const double space = miss.head<3>().norm();
    const double time = pin.in_time ? std::abs(miss[3]) : 0.0;
    ++report.num_nodes;
    report.residual_m = std::max(report.residual_m, space * edge_length_m);
    report.residual_frames = std::max(report.residual_frames, time);
    report.kept = report.kept && (pin.hard || std::hypot(space, time) <= kOverruled);
  }
  return reports;
}

}  // namespace liquidblend::registration
