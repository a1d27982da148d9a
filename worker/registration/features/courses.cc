#include "worker/registration/features/courses.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace liquidblend::registration {
namespace {

constexpr double kMinLife = 1.0;  // frames; what lives hardly longer than a frame has no course
constexpr double kMinFall = 0.3;  // edges per frame; slower parts do not tell when they strike
constexpr double kMaxCorrection = 1.0;  // frames; ends are known to a frame
constexpr double kMaxScale = 2.0;
// Users' points: what belongs to the part, in its radii, and how far they may be from the course.
constexpr double kOfPart = 1.3;
constexpr double kSameTime = 2.0;  // frames; as far beyond the ends of a life, too

// Height of the last part's lowest vertex.
double Lowest(const Track& track, const mesh::HeightAxis& height) {
  std::array<int, 3> down = {};
  down[height.axis] = -height.sign;
  const auto found = std::find(kReachDirections.begin(), kReachDirections.end(), down);
  const Part& last = track.parts.back();
  return height.sign * last.centre[height.axis] - last.reach[found - kReachDirections.begin()];
}

Eigen::Vector3d VelocityAt(const Track& track, double time) {
  return (track.At(time + 0.5).centre - track.At(time - 0.5).centre).head<3>();
}

bool IsOfPart(const Track& track, const Eigen::Vector4d& point, double beyond = 0.0) {
  if (point[3] < track.start_time - beyond || point[3] > track.end_time + beyond) return false;
  const Part part = track.At(point[3]);
  return (point - part.centre).head<3>().norm() <= kOfPart * part.radius();
}

bool Contradicts(const Correspondence& user, const Course& course, double edge_length_m) {
  if (user.kind == CorrespondenceKind::kSpace) return false;
  Eigen::Vector4d source = user.source, target = user.target;
  source.head<3>() /= edge_length_m;
  target.head<3>() /= edge_length_m;
  if (!IsOfPart(course.source, source) && !IsOfPart(course.target, target)) return false;
  return !IsOfPart(course.source, source, kSameTime) ||
         !IsOfPart(course.target, target, kSameTime) ||
         std::abs(source[3] * course.pace + course.lead - target[3]) > kSameTime;
}

std::vector<int8_t> OfVertices(const std::vector<int32_t>& track_of,
                               const std::vector<int8_t>& course_of) {
  std::vector<int8_t> result;
  result.reserve(track_of.size());
  for (const int32_t track : track_of) result.push_back(track < 0 ? -1 : course_of[track]);
  return result;
}

}  // namespace

std::optional<Course> CourseOf(const Track& source, const Track& target, mesh::Up up) {
  if (source.end != TrackEnd::kMerge || target.end != TrackEnd::kMerge) return std::nullopt;
  if (std::min(source.life(), target.life()) <= kMinLife) return std::nullopt;
  double end = target.end_time;
  const mesh::HeightAxis height = mesh::AxisOf(up);
  const double fall = height.sign * VelocityAt(target, end)[height.axis];
  if (std::abs(fall) >= kMinFall) {
    end += std::clamp((Lowest(source, height) - Lowest(target, height)) / fall, -kMaxCorrection,
                      kMaxCorrection);
  }
  Course course{source, target};
  course.pace = (end - target.start_time) / source.life();
  course.lead = target.start_time - course.pace * source.start_time;
  course.scale = std::clamp(target.diameter() / source.diameter(), 1 / kMaxScale, kMaxScale);
  if (!(course.pace > 0)) return std::nullopt;
  return course;
}

Expected ExpectedOn(const Course& course, const Eigen::Vector4f& point,
                    const Eigen::Vector4f& normal) {
  const double time = point[3], target_time = time * course.pace + course.lead;
  const Eigen::Vector3d from = course.source.At(time).centre.head<3>();
  const Eigen::Vector3d to = course.target.At(target_time).centre.head<3>();
  Expected expected;
  expected.point.head<3>() =
      (to + course.scale * (point.head<3>().cast<double>() - from)).cast<float>();
  expected.point[3] = static_cast<float>(target_time);
  // J^-T N for J = [scale I, drift; 0, pace].
  const Eigen::Vector3d drift = course.pace * VelocityAt(course.target, target_time) -
                                course.scale * VelocityAt(course.source, time);
  const Eigen::Vector3d in_space = normal.head<3>().cast<double>() / course.scale;
  Eigen::Vector4d image;
  image << in_space, (normal[3] - drift.dot(in_space)) / course.pace;
  expected.normal = image.normalized().cast<float>();
  return expected;
}

Courses::Courses(const Features& source, const Features& target,
                 const std::vector<AssignedPair>& tracks, const std::vector<Correspondence>& users,
                 double edge_length_m) {
  std::vector<int8_t> of_source_track(source.tracks.size(), -1);
  std::vector<int8_t> of_target_track(target.tracks.size(), -1);
  for (const AssignedPair& pair : tracks) {
    const auto course = CourseOf(source.tracks[pair.row], target.tracks[pair.column], source.up);
    if (!course) continue;
    const bool is_contradicted = std::any_of(
        users.begin(), users.end(),
        [&](const Correspondence& user) { return Contradicts(user, *course, edge_length_m); });
    if (is_contradicted) continue;
    static_assert(2 * kMaxAssigned <= std::numeric_limits<int8_t>::max());
    of_source_track[pair.row] = static_cast<int8_t>(courses_.size());
    of_target_track[pair.column] = static_cast<int8_t>(courses_.size());
    courses_.push_back(*course);
  }
  if (courses_.empty()) return;
  of_source_ = OfVertices(source.track_of, of_source_track);
  of_target_ = OfVertices(target.track_of, of_target_track);
}

const Course* Courses::Of(int64_t source_vertex) const {
  if (of_source_.empty() || of_source_[source_vertex] < 0) return nullptr;
  return &courses_[of_source_[source_vertex]];
}

bool Courses::HasTarget(int64_t target_vertex) const {
  return !of_target_.empty() && of_target_[target_vertex] >= 0;
}

}  // namespace liquidblend::registration
