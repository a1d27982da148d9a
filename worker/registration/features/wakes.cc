#include "worker/registration/features/wakes.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "core/mesh/slice_at.h"
#include "worker/registration/features/height_field.h"
#include "worker/registration/features/median.h"
#include "worker/registration/features/part_motions.h"

namespace liquidblend::registration {
namespace {

constexpr double kGravity = 9.81;  // m/s^2
constexpr double kSpacing = 1.0;   // edges; of the grids of heights ...
constexpr double kMaxSteps = 24;   // ... unless the part has more than these across
constexpr double kMinSpeed = 0.3;  // edges per frame; slower parts leave no crater
constexpr double kMinShare = 0.7;  // of a patch that has heights in both animations

// A strike of a paired track in both animations. Registration units.
struct Strike {
  Eigen::Vector2d source_place, target_place;
  double source_time = 0.0, target_time = 0.0;
  double diameter = 0.0;  // of the part
  double duration = 0.0;  // frames; until the part has gone in
  double spacing() const { return std::max(kSpacing, diameter / kMaxSteps); }
  Eigen::Vector2d shift() const { return target_place - source_place; }
};

double SpeedAtEnd(const Track& track) {
  const Eigen::Vector4d moved =
      track.At(track.end_time).centre - track.At(track.end_time - 1).centre;
  return moved.head<3>().norm();
}

std::optional<Strike> StrikeOf(const Track& source, const Track& target, mesh::Up up) {
  const auto motion = PartMotionOf(source, target, up);
  if (!motion) return std::nullopt;
  const mesh::HeightAxis height = mesh::AxisOf(up);
  Strike strike;
  strike.source_time = source.end_time;
  strike.target_time = source.end_time * motion->time_scale + motion->time_offset;
  strike.source_place = PlaceOf(source.At(strike.source_time).centre.head<3>(), height);
  strike.target_place = PlaceOf(target.At(strike.target_time).centre.head<3>(), height);
  strike.diameter = std::sqrt(source.diameter() * target.diameter());
  const double speed = std::min(SpeedAtEnd(source), SpeedAtEnd(target));
  strike.duration = strike.diameter / std::max(kMinSpeed, speed);
  return strike;
}

// Grid of places around a centre within a radius.
std::vector<Eigen::Vector2d> Disk(const Eigen::Vector2d& centre, double radius, double step) {
  std::vector<Eigen::Vector2d> places;
  const int reach = static_cast<int>(radius / step);
  for (int j = -reach; j <= reach; ++j) {
    for (int i = -reach; i <= reach; ++i) {
      const Eigen::Vector2d offset(i * step, j * step);
      if (offset.norm() <= radius) places.push_back(centre + offset);
    }
  }
  return places;
}

// Heights at some places of the source; those without liquid are left out.
struct Patch {
  std::vector<Eigen::Vector2d> places;
  std::vector<double> heights;
  double relief = 0.0;  // of the height furthest from the median; signed
  // Middle of what is at least half as far from the median on the same side: the bottom of a
  // crater, the tip of a jet. What is the furthest on a flat bottom may be anywhere on it.
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
};

std::optional<Patch> PatchOf(const HeightField& field, const Eigen::Vector2d& centre,
                             double radius) {
  Patch patch;
  const std::vector<Eigen::Vector2d> disk = Disk(centre, radius, field.spacing());
  for (const Eigen::Vector2d& place : disk) {
    const double height = field.At(place);
    if (std::isnan(height)) continue;
    patch.places.push_back(place);
    patch.heights.push_back(height);
  }
  if (static_cast<double>(patch.places.size()) < kMinShare * static_cast<double>(disk.size())) {
    return std::nullopt;
  }
  const double median = Median(patch.heights);
  for (const double height : patch.heights) {
    if (std::abs(height - median) > std::abs(patch.relief)) patch.relief = height - median;
  }
  double sum = 0;
  for (size_t n = 0; n < patch.heights.size(); ++n) {
    const double weight = (patch.heights[n] - median) / patch.relief - 0.5;
    if (!(weight > 0)) continue;
    sum += weight;
    patch.middle += weight * patch.places[n];
  }
  if (!(sum > 0)) return std::nullopt;
  patch.middle /= sum;
  return patch;
}

// How well a patch moved by a shift explains the other heights around there.
struct Explained {
  double residual = 1.0;  // [0, 1]; share of the other heights' variance that it leaves over, up to
                          // a constant and a factor above 0
  double factor = 0.0;    // of its relief; 0: it explains nothing
};

Explained ExplainedAt(const Patch& patch, const HeightField& field, const Eigen::Vector2d& shift) {
  double x = 0, y = 0, xx = 0, xy = 0, yy = 0, count = 0;
  for (size_t n = 0; n < patch.places.size(); ++n) {
    const double other = field.At(patch.places[n] + shift), own = patch.heights[n];
    if (std::isnan(other)) continue;
    ++count;
    x += own, y += other;
    xx += own * own, xy += own * other, yy += other * other;
  }
  if (count < kMinShare * static_cast<double>(patch.places.size())) return {};
  const double own_variance = xx - x * x / count, covariance = xy - x * y / count;
  const double other_variance = yy - y * y / count;
  if (!(covariance > 0) || !(other_variance > 0)) return {};
  const double explained = covariance * covariance / (own_variance * other_variance);
  return {std::max(0.0, 1 - explained), covariance / own_variance};
}

struct FoundShift {
  Eigen::Vector2d shift;
  Explained explained;
};

// The best of the shifts near `expected`, first in steps of the grid, then in halves.
FoundShift BestShift(const Patch& patch, const HeightField& field, const Eigen::Vector2d& expected,
                     double search) {
  FoundShift best{expected, {}};
  const auto try_around = [&](double radius, double step) {
    for (const Eigen::Vector2d& shift : Disk(best.shift, radius, step)) {
      const Explained explained = ExplainedAt(patch, field, shift);
      if (explained.residual < best.explained.residual) best = {shift, explained};
    }
  };
  try_around(search, field.spacing());
  try_around(field.spacing(), 0.5 * field.spacing());
  return best;
}

class WakeFinder {
 public:
  WakeFinder(const Strike& strike, mesh::Up up, const WakeOptions& options)
      : strike_(strike), up_(mesh::AxisOf(up)), options_(options) {}

  // Heights of a slice around a strike, as far as patches and searches reach.
  HeightField View(const mesh::TriangleMesh& slice, const Eigen::Vector2d& place) const {
    const double reach = (options_.radius + 2 * options_.search) * strike_.diameter;
    return HeightField(slice, up_, place, reach, strike_.spacing(), Seen::kLargestPart);
  }

  // Looks for the wake near `expected`, and moves it to where it is found.
  std::optional<EventPair> Find(const mesh::TriangleMesh& source, const mesh::TriangleMesh& target,
                                double time_after, Eigen::Vector2d& expected) const {
    const HeightField from = View(source, strike_.source_place);
    const HeightField to = View(target, strike_.target_place);
    const auto patch = PatchOf(from, strike_.source_place, options_.radius * strike_.diameter);
    if (!patch || std::abs(patch->relief) < options_.min_relief) return std::nullopt;
    const FoundShift found = BestShift(*patch, to, expected, options_.search * strike_.diameter);
    const Explained unmoved =
        ExplainedAt(*patch, View(target, strike_.source_place), Eigen::Vector2d::Zero());
    if (!IsClear(found.explained, unmoved)) return std::nullopt;
    expected = found.shift;
    return PairAt(patch->middle, from, to, found.shift, time_after);
  }

 private:
  bool IsClear(const Explained& found, const Explained& unmoved) const {
    return found.residual <= options_.max_residual &&
           unmoved.residual >= options_.min_gain * found.residual &&
           found.factor <= options_.max_factor && found.factor >= 1 / options_.max_factor;
  }

  std::optional<EventPair> PairAt(const Eigen::Vector2d& place, const HeightField& from,
                                  const HeightField& to, const Eigen::Vector2d& shift,
                                  double time_after) const {
    const double height = from.At(place), other_height = to.At(place + shift);
    if (std::isnan(height) || std::isnan(other_height)) return std::nullopt;
    EventPair pair;
    pair.source << PointAt(place, height, up_), strike_.source_time + time_after;
    pair.target << PointAt(place + shift, other_height, up_), strike_.target_time + time_after;
    return pair;
  }

  const Strike& strike_;
  const mesh::HeightAxis up_;
  const WakeOptions& options_;
};

// Times after the strike, from when the part has gone in, up to the end of either animation.
std::vector<double> TimesAfter(const Strike& strike, const Surface& source, const Surface& target,
                               double edge_length_m, const WakeOptions& options) {
  const double crater_s = std::sqrt(strike.diameter * edge_length_m / kGravity);
  const double step = options.time_step * crater_s * source.mesh.frames_per_second;
  const double last = std::min(source.mesh.num_frames - 1 - strike.source_time,
                               target.mesh.num_frames - 1 - strike.target_time);
  std::vector<double> times;
  for (int n = 1; n <= options.num_times && n * step <= last; ++n) {
    if (n * step >= strike.duration) times.push_back(n * step);
  }
  return times;
}

std::vector<mesh::TriangleMesh> SlicesAfter(const Surface& surface, double strike_time,
                                            std::vector<double> times,
                                            const parallel::Arena& arena) {
  const double last = surface.mesh.num_frames - 1;
  for (double& time : times) time = std::min(last, time + strike_time);
  return mesh::SliceAt(surface.mesh, surface.points, times, arena);
}

std::vector<EventPair> PointsAfter(const Strike& strike, const Surface& source,
                                   const Surface& target, double edge_length_m,
                                   const parallel::Arena& arena, const WakeOptions& options) {
  const std::vector<double> times = TimesAfter(strike, source, target, edge_length_m, options);
  std::vector<EventPair> points;
  if (times.size() < options.min_points) return points;
  const auto of_source = SlicesAfter(source, strike.source_time, times, arena);
  const auto of_target = SlicesAfter(target, strike.target_time, times, arena);
  const WakeFinder finder(strike, source.mesh.up, options);
  Eigen::Vector2d shift = strike.shift();
  for (size_t k = 0; k < times.size(); ++k) {
    const auto found = finder.Find(of_source[k], of_target[k], times[k], shift);
    if (found) points.push_back(*found);
  }
  return points;
}

}  // namespace

std::vector<Wake> FindWakes(const Surface& source, const Surface& target, const Features& from,
                            const Features& to, const std::vector<AssignedPair>& tracks,
                            double edge_length_m, const parallel::Arena& arena,
                            const WakeOptions& options) {
  std::vector<Wake> wakes;
  for (size_t n = 0; n < tracks.size(); ++n) {
    const auto strike =
        StrikeOf(from.tracks[tracks[n].row], to.tracks[tracks[n].column], source.mesh.up);
    if (!strike || strike->shift().norm() < options.min_shift) continue;
    std::vector<EventPair> points =
        PointsAfter(*strike, source, target, edge_length_m, arena, options);
    if (points.size() < options.min_points) continue;
    wakes.push_back({static_cast<int>(n), std::move(points)});
  }
  return wakes;
}

}  // namespace liquidblend::registration
