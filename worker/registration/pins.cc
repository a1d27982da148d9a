#include "worker/registration/pins.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace liquidblend::registration {
namespace {

constexpr double kPinEveryFrames = 10;  // section 6, "typically every 10 frames"

// One animation's side of the correspondences.
struct Side {
  Side(const Surface& s, double edge_length_m, const char* side_name)
      : surface(s), edge(edge_length_m), name(side_name), tree(s.points, s.FreeVertices()) {}
  const Surface& surface;
  double edge;  // metres per registration unit
  const char* name;
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

absl::Status Check(size_t index, const Side& side, const Eigen::Vector4d& event, bool traced) {
  const std::string where = absl::StrCat("correspondence ", index, ", ", side.name);
  if (!event.allFinite()) return absl::InvalidArgumentError(where + ": a number is not finite");
  if (event[3] < 0 || event[3] > side.last_frame()) {
    return absl::InvalidArgumentError(absl::StrCat(where, ": its time is frame ", event[3],
                                                   ", not in [0, ", side.last_frame(), "]"));
  }
  if (traced && side.surface.mesh.velocities.cols() == 0) {
    return absl::InvalidArgumentError(
        where + ": a trajectory needs velocities, which the animation does not have");
  }
  return absl::OkStatus();
}

void AddPin(const Side& source, const Eigen::Vector4f& from, const Eigen::Vector4f& to, bool hard,
            bool in_time, std::vector<Pin>& pins) {
  const int32_t v = source.NearestVertex(from);
  pins.push_back({v, to - from, hard, in_time});
}

void Expand(const Correspondence& c, const Side& source, const Side& target,
            std::vector<Pin>& pins) {
  const Eigen::Vector4f from = source.ToUnits(c.source), to = target.ToUnits(c.target);
  if (c.kind == CorrespondenceKind::kPoint) {
    AddPin(source, from, to, c.hard, true, pins);
    return;
  }
  const bool in_time = c.kind == CorrespondenceKind::kTrajectory;
  const double left =
      std::min(source.last_frame() - c.source[3], target.last_frame() - c.target[3]);
  const double length = c.length_frames > 0 ? std::min(c.length_frames, left) : left;
  for (double frames = 0; frames <= length; frames += kPinEveryFrames) {
    Eigen::Vector4f a = from, b = to;
    if (in_time) {
      a = source.Trace(from, frames);
      b = target.Trace(to, frames);
    } else {
      a[3] += static_cast<float>(frames);
      b[3] += static_cast<float>(frames);
    }
    AddPin(source, a, b, c.hard, in_time, pins);
  }
}

}  // namespace

absl::StatusOr<std::vector<Pin>> ExpandCorrespondences(
    const std::vector<Correspondence>& correspondences, const Surface& source,
    const Surface& target) {
  std::vector<Pin> pins;
  if (correspondences.empty()) return pins;
  const double edge = source.mesh.edge_length_m;
  const Side from(source, edge, "source"), to(target, edge, "target");
  for (size_t n = 0; n < correspondences.size(); ++n) {
    const Correspondence& c = correspondences[n];
    const bool traced = c.kind == CorrespondenceKind::kTrajectory;
    LB_RETURN_IF_ERROR(Check(n, from, c.source, traced));
    LB_RETURN_IF_ERROR(Check(n, to, c.target, traced));
    if (!(c.length_frames >= 0) || !std::isfinite(c.length_frames)) {
      return absl::InvalidArgumentError(absl::StrCat("correspondence ", n, ": its length is ",
                                                     c.length_frames, " frames, not >= 0"));
    }
    Expand(c, from, to, pins);
  }
  return pins;
}

FitTerm TermOf(const Pin& pin, double weight) {
  Eigen::Vector4f diagonal = Eigen::Vector4f::Constant(static_cast<float>(weight));
  if (!pin.in_time) diagonal[3] = 0;
  return {pin.vertex, pin.goal, diagonal.asDiagonal()};
}

}  // namespace liquidblend::registration
