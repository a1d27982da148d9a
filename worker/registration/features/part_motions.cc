#include "worker/registration/features/part_motions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "worker/registration/features/free_fall.h"
#include "worker/registration/features/height_field.h"

namespace liquidblend::registration {
namespace {

constexpr int kMaxMotions = std::numeric_limits<int8_t>::max();
// What is left of the life of a part that is joined with the rest in the target's first frame. Not
// 0, since errors of the fit that lead before the first frame are large where squares of times
// blend.
constexpr double kFramesAtStart = 0.5;
constexpr double kMinLife = 1.0;  // frames; shorter lives have no motion
constexpr double kMinFall = 0.3;  // edges per frame; slower parts do not tell when they strike
constexpr double kMaxCorrection = 1.0;  // frames; ends are known to a frame
constexpr double kMaxScale = 2.0;
constexpr double kMaxAcceleration = 1.1;  // half-way
// Limits for users' points: distance from the part's centre, in its radii; distance from its
// motion.
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

bool Contradicts(const Correspondence& user, const PartMotion& motion, double edge_length_m) {
  if (user.kind == CorrespondenceKind::kSpace) return false;
  Eigen::Vector4d source = user.source, target = user.target;
  source.head<3>() /= edge_length_m;
  target.head<3>() /= edge_length_m;
  if (motion.begins_in_pre_roll) {
    // A user points to the part in the first frames, where it is joined with the rest.
    const bool is_first = source[3] <= kSameTime;
    source[3] = motion.source.end_time;
    return (is_first && IsOfPart(motion.source, source)) !=
           IsOfPart(motion.target, target, kSameTime);
  }
  if (!IsOfPart(motion.source, source) && !IsOfPart(motion.target, target)) return false;
  return !IsOfPart(motion.source, source, kSameTime) ||
         !IsOfPart(motion.target, target, kSameTime) ||
         std::abs(source[3] * motion.time_scale + motion.time_offset - target[3]) > kSameTime;
}

mesh::PartLife LifeOf(const PartMotion& motion, double edge_length_m) {
  const Eigen::Vector3d centre = motion.source.parts.front().centre.head<3>() * edge_length_m;
  const double end = motion.source.end_time;
  return {
      {static_cast<float>(centre[0]), static_cast<float>(centre[1]), static_cast<float>(centre[2])},
      motion.begins_in_pre_roll ? 0.0 : end,
      end * motion.time_scale + motion.time_offset};
}

bool IsInFirstFrames(const PartMotion& motion) {
  return motion.source.start == TrackStart::kFirstFrame &&
         motion.target.start == TrackStart::kFirstFrame;
}

std::vector<int8_t> OfVertices(const std::vector<int32_t>& track_of,
                               const std::vector<int8_t>& motion_of) {
  std::vector<int8_t> result;
  result.reserve(track_of.size());
  for (const int32_t track : track_of) result.push_back(track < 0 ? -1 : motion_of[track]);
  return result;
}

}  // namespace

std::optional<PartMotion> PartMotionOf(const Track& source, const Track& target, mesh::Up up) {
  if (source.end != TrackEnd::kMerge || target.end != TrackEnd::kMerge) return std::nullopt;
  if (std::min(source.life(), target.life()) <= kMinLife) return std::nullopt;
  double end = target.end_time;
  const mesh::HeightAxis height = mesh::AxisOf(up);
  const double fall = height.sign * VelocityAt(target, end)[height.axis];
  if (std::abs(fall) >= kMinFall) {
    end += std::clamp((Lowest(source, height) - Lowest(target, height)) / fall, -kMaxCorrection,
                      kMaxCorrection);
  }
  PartMotion motion{source, target};
  motion.time_scale = (end - target.start_time) / source.life();
  motion.time_offset = target.start_time - motion.time_scale * source.start_time;
  motion.scale = std::clamp(target.diameter() / source.diameter(), 1 / kMaxScale, kMaxScale);
  if (!(motion.time_scale > 0)) return std::nullopt;
  return motion;
}

std::optional<PartMotion> MotionToStart(const Track& source, const Lump& from, const Lump& to,
                                        mesh::Up up) {
  const bool is_fall = source.start == TrackStart::kFirstFrame && source.end == TrackEnd::kMerge;
  if (!is_fall || source.life() <= kMinLife) return std::nullopt;
  const mesh::HeightAxis height = mesh::AxisOf(up);
  const double rise = to.height - from.height;
  Part there = source.At(source.start_time);
  const Eigen::Vector3d centre = there.centre.head<3>();
  const Eigen::Vector2d place = PlaceOf(centre, height) + to.place - from.place;
  there.centre.head<3>() = PointAt(place, height.sign * centre[height.axis] + rise, height);
  PartMotion motion;
  motion.source = source;
  motion.target.end_time = kFramesAtStart;
  motion.target.end = TrackEnd::kMerge;
  motion.target.volume = source.volume;
  motion.target.parts = {there};
  motion.time_scale = kFramesAtStart / source.life();
  motion.ends_at_start = true;
  return motion;
}

std::optional<PartMotion> MotionFromPreRoll(const Track& source, const Track& target, mesh::Up up) {
  Track ended = target;
  if (target.end == TrackEnd::kLastFrame) ended.end = TrackEnd::kMerge;  // later than is seen
  auto motion = PartMotionOf(source, ended, up);
  if (motion) motion->begins_in_pre_roll = true;
  return motion;
}

PartMotion MotionBeforeStart(const Track& source) {
  PartMotion motion{source, source};
  motion.ends_at_start = true;
  return motion;
}

double AccelerationHalfWay(const PartMotion& motion, mesh::Up up) {
  const double s = motion.time_scale;
  const std::optional<FreeFall> fall = FitFreeFall(s > 1 ? motion.target : motion.source, up);
  if (!fall || !fall->is_free()) return 1.0;
  return 2 * (1 + s * s) / ((1 + s) * (1 + s));
}

Expected ExpectedOn(const PartMotion& motion, const Eigen::Vector4f& point,
                    const Eigen::Vector4f& normal) {
  const double time = point[3];
  const bool is_before = motion.begins_in_pre_roll && time < motion.source.start_time;
  const double time_scale = is_before ? 1.0 : motion.time_scale;
  const double target_time = is_before ? motion.target.start_time + time - motion.source.start_time
                                       : time * time_scale + motion.time_offset;
  const Eigen::Vector3d from = motion.source.At(time).centre.head<3>();
  const Eigen::Vector3d to = motion.target.At(target_time).centre.head<3>();
  Expected expected;
  expected.point.head<3>() =
      (to + motion.scale * (point.head<3>().cast<double>() - from)).cast<float>();
  expected.point[3] = static_cast<float>(target_time);
  // J^-T N for J = [scale I, drift; 0, time_scale].
  const Eigen::Vector3d drift = time_scale * VelocityAt(motion.target, target_time) -
                                motion.scale * VelocityAt(motion.source, time);
  const Eigen::Vector3d in_space = normal.head<3>().cast<double>() / motion.scale;
  Eigen::Vector4d image;
  image << in_space, (normal[3] - drift.dot(in_space)) / time_scale;
  expected.normal = image.normalized().cast<float>();
  return expected;
}

PartMotions::PartMotions(const Features& source, const Features& target, const FeaturePairs& pairs,
                         const std::vector<Correspondence>& users, double edge_length_m,
                         TimesBlend times) {
  std::vector<int8_t> of_source_track(source.tracks.size(), -1);
  std::vector<int8_t> of_target_track(target.tracks.size(), -1);
  std::vector<int8_t> part_of_track(source.tracks.size(), -1);
  const auto is_contradicted = [&](const PartMotion& motion) {
    return std::any_of(users.begin(), users.end(), [&](const Correspondence& user) {
      return Contradicts(user, motion, edge_length_m);
    });
  };
  for (const AssignedPair& pair : pairs.tracks) {
    const auto motion =
        PartMotionOf(source.tracks[pair.row], target.tracks[pair.column], source.up);
    if (!motion) continue;
    if (is_contradicted(*motion)) continue;
    part_of_track[pair.row] = static_cast<int8_t>(parts_.size());
    parts_.push_back({motion->source, motion->scale});
    if (IsInFirstFrames(*motion)) lives_.push_back(LifeOf(*motion, edge_length_m));
    const bool is_too_fast = AccelerationHalfWay(*motion, source.up) > kMaxAcceleration;
    if (times == TimesBlend::kLinearly && is_too_fast) continue;
    static_assert(2 * kMaxAssigned <= kMaxMotions);
    of_source_track[pair.row] = static_cast<int8_t>(motions_.size());
    of_target_track[pair.column] = static_cast<int8_t>(motions_.size());
    motions_.push_back(*motion);
  }
  const auto add = [&](const PartMotion& motion, int track) {
    if (is_contradicted(motion) || motions_.size() >= kMaxMotions) return false;
    of_source_track[track] = static_cast<int8_t>(motions_.size());
    motions_.push_back(motion);
    return true;
  };
  for (const JoinedTrack& joined : pairs.joined.target) {
    if (joined.pre_roll_track < 0) continue;
    const auto motion = MotionFromPreRoll(source.tracks[joined.pre_roll_track],
                                          target.tracks[joined.track], source.up);
    if (!motion || !add(*motion, joined.pre_roll_track)) continue;
    lives_.push_back(LifeOf(*motion, edge_length_m));
    of_target_track[joined.track] = of_source_track[joined.pre_roll_track];
    part_of_track[joined.pre_roll_track] = static_cast<int8_t>(parts_.size());
    parts_.push_back({motion->source, motion->scale});
  }
  for (int n = 0; n < static_cast<int>(source.tracks.size()); ++n) {
    if (!source.tracks[n].is_pre_roll() || of_source_track[n] >= 0) continue;
    add(MotionBeforeStart(source.tracks[n]), n);
  }
  for (const JoinedTrack& joined : pairs.joined.source) {
    const auto motion = MotionToStart(source.tracks[joined.track], source.lumps[joined.own_lump],
                                      target.lumps[joined.other_lump], source.up);
    if (motion) add(*motion, joined.track);
  }
  if (!parts_.empty()) part_of_ = OfVertices(source.track_of, part_of_track);
  if (motions_.empty()) return;
  of_source_ = OfVertices(source.track_of, of_source_track);
  of_target_ = OfVertices(target.track_of, of_target_track);
}

const PartMotion* PartMotions::Of(int64_t source_vertex) const {
  if (of_source_.empty() || of_source_[source_vertex] < 0) return nullptr;
  return &motions_[of_source_[source_vertex]];
}

int PartMotions::PartOf(int64_t source_vertex) const {
  return part_of_.empty() ? -1 : part_of_[source_vertex];
}

bool PartMotions::HasTarget(int64_t target_vertex) const {
  return !of_target_.empty() && of_target_[target_vertex] >= 0;
}

}  // namespace liquidblend::registration
