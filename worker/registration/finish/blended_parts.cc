#include "worker/registration/finish/blended_parts.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "core/mesh/components.h"
#include "worker/registration/features/free_fall.h"
#include "worker/registration/surface/blend_figures.h"

namespace liquidblend::registration {
namespace {

constexpr int kNumTimes = 6;         // of a life
constexpr double kMinLife = 4.0;     // frames; of shorter ones nothing is compared
constexpr double kEndFrames = 1.0;   // before the end: there the part is one with the rest
constexpr double kLikeVolume = 2.0;  // factor; other parts are not the one that is looked for

double Mean(double weight, double source, double target) {
  return (1 - weight) * source + weight * target;
}

double VolumeOf(double diameter) { return std::numbers::pi / 6 * std::pow(diameter, 3); }

// What lies between both animations' parts at a share of their lives.
struct Wanted {
  Eigen::Vector4d place;  // centre and time
  double diameter;
  double min_volume, max_volume;
};

Wanted WantedOf(const PartOfBoth& part, double weight, double share) {
  const auto at = [&](const Track& track) {
    const double time = std::max(0.0, track.start_time + share * (track.life() - kEndFrames));
    Eigen::Vector4d place = track.At(time).centre;
    place[3] = time;
    return place;
  };
  Wanted wanted;
  wanted.place = (1 - weight) * at(part.source) + weight * at(part.target);
  wanted.diameter = Mean(weight, part.source.diameter(), part.target.diameter());
  wanted.min_volume = VolumeOf(wanted.diameter);
  wanted.max_volume = Mean(weight, part.source.volume, part.target.volume);
  return wanted;
}

// The detached part of a slice that is wanted, in registration units: of those of like volume the
// nearest, within a diameter.
std::optional<mesh::Component> FindPiece(const std::vector<mesh::Component>& components,
                                         const Wanted& wanted, double edge_length_m) {
  std::optional<mesh::Component> nearest;
  double least = wanted.diameter;
  for (mesh::Component component : components) {
    component.volume /= std::pow(edge_length_m, 3);
    component.centre /= edge_length_m;
    if (!(component.volume >= wanted.min_volume / kLikeVolume)) continue;
    if (component.volume > wanted.max_volume * kLikeVolume) continue;
    const double distance = (component.centre - wanted.place.head<3>()).norm();
    if (distance >= least) continue;
    least = distance;
    nearest = component;
  }
  return nearest;
}

void Raise(double value, const Eigen::Vector4d& place, PartError& error) {
  if (value > error.value) error = {value, place};
}

double VolumeError(double volume, const Wanted& wanted) {
  if (volume < wanted.min_volume) return 1 - volume / wanted.min_volume;
  return std::max(0.0, volume / wanted.max_volume - 1);
}

// Track of a blend's part, of its centres where it was found.
Track CourseOf(const std::vector<Eigen::Vector4d>& centres) {
  Track course;
  for (const Eigen::Vector4d& centre : centres) course.parts.emplace_back().centre = centre;
  if (centres.empty()) return course;
  course.start_time = centres.front()[3];
  course.end_time = centres.back()[3] + kEndFrames;
  return course;
}

void CompareFall(const PartOfBoth& part, double weight, const Track& course, mesh::Up up,
                 const Eigen::Vector4d& place, PartErrors& errors) {
  const auto fall = FitFreeFall(course, up);
  const auto of_source = FitFreeFall(part.source, up), of_target = FitFreeFall(part.target, up);
  if (!fall || !of_source || !of_target || !of_source->is_free() || !of_target->is_free()) return;
  const double wanted = Mean(weight, of_source->acceleration, of_target->acceleration);
  Raise(std::abs(fall->acceleration / wanted - 1), place, errors.fall);
}

// What a part of the blend should be, at some times of its life.
std::vector<Wanted> WantedOver(const PartOfBoth& part, double weight, double last_frame) {
  std::vector<Wanted> wanted;
  for (int n = 0; n < kNumTimes; ++n) {
    wanted.push_back(WantedOf(part, weight, n / (kNumTimes - 1.0)));
    if (wanted.back().place[3] > last_frame) wanted.pop_back();
  }
  return wanted;
}

// Components of a blend's slices at some times.
class BlendComponents {
 public:
  BlendComponents(const Surface& source, const Points& displacement, float weight,
                  std::vector<double> times, const parallel::Arena& arena)
      : times_(std::move(times)) {
    std::sort(times_.begin(), times_.end());
    times_.erase(std::unique(times_.begin(), times_.end()), times_.end());
    at_ = ComponentsAt(source.mesh, BlendAt(source, displacement, weight), times_, arena);
  }
  // Requires: one of the times.
  const std::vector<mesh::Component>& At(double time) const {
    return at_[std::lower_bound(times_.begin(), times_.end(), time) - times_.begin()];
  }

 private:
  std::vector<double> times_;
  std::vector<std::vector<mesh::Component>> at_;
};

void ComparePart(const PartOfBoth& part, double weight, const std::vector<Wanted>& wanted,
                 const BlendComponents& components, const mesh::SpaceTimeMesh& mesh,
                 PartErrors& errors) {
  std::vector<Eigen::Vector4d> centres;
  for (const Wanted& next : wanted) {
    const auto piece = FindPiece(components.At(next.place[3]), next, mesh.edge_length_m);
    if (!piece) {
      Raise(1, next.place, errors.shift);
      continue;
    }
    const double distance = (piece->centre - next.place.head<3>()).norm();
    Raise(distance / next.diameter, next.place, errors.shift);
    Raise(VolumeError(piece->volume, next), next.place, errors.volume);
    centres.emplace_back() << piece->centre, next.place[3];
  }
  if (centres.empty()) return;
  CompareFall(part, weight, CourseOf(centres), mesh.up, centres.back(), errors);
}

}  // namespace

std::vector<PartOfBoth> PartsOfBoth(const Features& source, const Features& target,
                                    const std::vector<AssignedPair>& pairs) {
  std::vector<PartOfBoth> parts;
  for (const AssignedPair& pair : pairs) {
    const Track &a = source.tracks[pair.row], &b = target.tracks[pair.column];
    const bool is_first = a.start == TrackStart::kFirstFrame && b.start == TrackStart::kFirstFrame;
    const bool ends_alike = a.end == b.end && a.end != TrackEnd::kVanishes;
    if (is_first && ends_alike && std::min(a.life(), b.life()) >= kMinLife) {
      parts.push_back({a, b});
    }
  }
  return parts;
}

PartErrors CompareParts(const Surface& source, const Points& displacement,
                        const std::vector<PartOfBoth>& parts, const parallel::Arena& arena) {
  PartErrors errors;
  const double last_frame = source.mesh.num_frames - 1.0;
  for (const float weight : kBlendWeights) {
    std::vector<std::vector<Wanted>> wanted;  // by part
    std::vector<double> times;
    for (const PartOfBoth& part : parts) {
      wanted.push_back(WantedOver(part, weight, last_frame));
      for (const Wanted& next : wanted.back()) times.push_back(next.place[3]);
    }
    if (times.empty()) continue;
    const BlendComponents components(source, displacement, weight, std::move(times), arena);
    for (size_t n = 0; n < parts.size(); ++n) {
      ComparePart(parts[n], weight, wanted[n], components, source.mesh, errors);
    }
  }
  return errors;
}

}  // namespace liquidblend::registration
