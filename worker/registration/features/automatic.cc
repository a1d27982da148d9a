#include "worker/registration/features/automatic.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "worker/registration/features/wakes.h"
#include "worker/registration/surface/closest_point.h"

namespace liquidblend::registration {
namespace {

constexpr double kEveryFrames = 10.0;  // as nodes of a user's trajectory
constexpr double kEndFrames = 1.0;     // before a part ends: there it is one with the rest
constexpr double kNearUsers = 10.0;    // edges and frames; there the user knows better ...
constexpr double kAgreeEdges = 3.0;    // ... unless both move things alike, within this
constexpr double kMovedEdges = 3.0;    // an obstacle that has moved less has not
constexpr float kOnSurface = 3.0f;     // edges; what is further off belongs to no vertex

// One pair of features.
struct PairedPoints {
  CorrespondenceKind kind;
  std::vector<EventPair> points;
  double confidence;
};

Eigen::Vector4d Furthest(const Part& part, size_t direction, double time) {
  const auto& d = kReachDirections[direction];
  Eigen::Vector4d point = part.centre;
  point.head<3>() += part.reach[direction] * Eigen::Vector3d(d[0], d[1], d[2]);
  point[3] = time;
  return point;
}

// Number of steps that a life is divided into. Once a part starts in the right place, closest
// points find its motion better than a linear time map does, unless its lives differ much in
// length. Parts that live hardly longer than a frame have no motion.
int NumSteps(double source_life, double target_life) {
  if (std::abs(source_life - target_life) <= kEveryFrames) return 0;
  if (std::min(source_life, target_life) < 1) return 0;
  return static_cast<int>(std::ceil(std::max(source_life, target_life) / kEveryFrames));
}

// Points along both lives, by a linear time map.
std::vector<EventPair> PointsOf(const Track& source, const Track& target) {
  const double source_life = source.life() - kEndFrames, target_life = target.life() - kEndFrames;
  // The time map is unknown where the lives do not end alike.
  const int steps = source.end == target.end ? NumSteps(source_life, target_life) : 0;
  std::vector<EventPair> points;
  for (int n = 0; n <= steps; ++n) {
    const double share = steps > 0 ? static_cast<double>(n) / steps : 0.0;
    const double source_time = source.start_time + share * source_life;
    const double target_time = target.start_time + share * target_life;
    const Part from = source.At(source_time), to = target.At(target_time);
    for (size_t d = 0; d < kReachDirections.size(); ++d) {
      points.push_back({Furthest(from, d, source_time), Furthest(to, d, target_time)});
    }
  }
  return points;
}

Eigen::Vector4d EventOf(const Contact& contact) {
  return {contact.place[0], contact.place[1], contact.place[2],
          static_cast<double>(contact.first_frame)};
}

// None where the obstacle has stayed where it is: closest points find that.
std::vector<EventPair> PointsOf(const Obstacle& source, const Obstacle& target) {
  std::vector<EventPair> points;
  double furthest = 0;
  for (const auto& [a, b] : PairContacts(source, target)) {
    points.push_back({EventOf(source.contacts[a]), EventOf(target.contacts[b])});
    const EventPair& last = points.back();
    furthest = std::max(furthest, (last.target - last.source).head<3>().norm());
  }
  if (furthest < kMovedEdges) points.clear();
  return points;
}

PairedPoints PointsOf(const AssignedPair& pair, const FeaturesOfPair& features) {
  return {CorrespondenceKind::kPoint,
          PointsOf(features.source.tracks[pair.row], features.target.tracks[pair.column]),
          pair.confidence};
}

// Those of extrema and obstacles.
std::vector<PairedPoints> PointsOfPlaces(const FeaturesOfPair& features,
                                         const FeaturePairs& pairs) {
  const Features &source = features.source, &target = features.target;
  std::vector<PairedPoints> result;
  for (const AssignedPair& pair : pairs.extrema) {
    result.push_back({CorrespondenceKind::kPoint,
                      {{source.extrema[pair.row].point, target.extrema[pair.column].point}},
                      pair.confidence});
  }
  for (const AssignedPair& pair : pairs.obstacles) {
    result.push_back({CorrespondenceKind::kSpace,
                      PointsOf(source.obstacles[pair.row], target.obstacles[pair.column]),
                      pair.confidence});
  }
  return result;
}

Eigen::Vector4d InUnits(Eigen::Vector4d event, double edge_length_m) {
  event.head<3>() /= edge_length_m;
  return event;
}

Eigen::Vector4d FromUnits(Eigen::Vector4d event, double edge_length_m) {
  event.head<3>() *= edge_length_m;
  return event;
}

// Whether a user's point is near one of a pair's, and sends it elsewhere.
bool Contradicts(const PairedPoints& pair, const std::vector<Correspondence>& users,
                 double edge_length_m) {
  const int used = pair.kind == CorrespondenceKind::kSpace ? 3 : 4;  // coordinates
  const auto distance = [&](const Eigen::Vector4d& a, const Eigen::Vector4d& b) {
    return (a - b).head(used).norm();
  };
  return std::any_of(users.begin(), users.end(), [&](const Correspondence& user) {
    const Eigen::Vector4d source = InUnits(user.source, edge_length_m);
    const Eigen::Vector4d target = InUnits(user.target, edge_length_m);
    return std::any_of(pair.points.begin(), pair.points.end(), [&](const EventPair& point) {
      const bool is_near = distance(point.source, source) < kNearUsers ||
                           distance(point.target, target) < kNearUsers;
      return is_near && distance(point.target - point.source, target - source) >= kAgreeEdges;
    });
  });
}

// The points of all pairs that no user's point contradicts. The wake of a part that the user knows
// better is not looked for.
std::vector<PairedPoints> PointsOfPairs(const Surface& source, const Surface& target,
                                        const FeaturesOfPair& features, const FeaturePairs& pairs,
                                        const std::vector<Correspondence>& users,
                                        double edge_length_m, const parallel::Arena& arena) {
  std::vector<PairedPoints> result;
  std::vector<AssignedPair> tracks;
  const auto add = [&](PairedPoints points) {
    if (Contradicts(points, users, edge_length_m)) return false;
    result.push_back(std::move(points));
    return true;
  };
  for (const AssignedPair& pair : pairs.tracks) {
    if (add(PointsOf(pair, features))) tracks.push_back(pair);
  }
  for (PairedPoints& points : PointsOfPlaces(features, pairs)) add(std::move(points));
  for (Wake& wake :
       FindWakes(source, target, features.source, features.target, tracks, edge_length_m, arena)) {
    add({CorrespondenceKind::kPoint, std::move(wake.points), tracks[wake.pair].confidence});
  }
  return result;
}

// Whether a point belongs to the part of a surface that is registered.
class OnSurface {
 public:
  OnSurface(const Surface& surface, const parallel::Arena& arena)
      : surface_(surface), tree_(surface.points, surface.FreeVertices(), arena) {}
  bool operator()(const Eigen::Vector4d& point) const {
    const Eigen::Vector4f query = point.cast<float>();
    std::array<int32_t, 1> found = {0};
    return tree_.Nearest(query, found) > 0 &&
           (surface_.points.col(found[0]) - query).norm() <= kOnSurface;
  }

 private:
  const Surface& surface_;
  PointTree tree_;
};

}  // namespace

Features FindTrackFeatures(const Surface& surface, const TrackOptions& options) {
  Features features;
  features.up = surface.mesh.up;
  const PartGraph graph = FindParts(surface);
  features.tracks = FindTracks(graph, surface.mesh.num_frames, options);
  features.lumps = FindLumps(surface, options.min_diameter);
  std::vector<int32_t> track_of_part(graph.parts.size(), -1);
  for (size_t n = 0; n < features.tracks.size(); ++n) {
    for (const Part& part : features.tracks[n].parts) {
      track_of_part[part.number] = static_cast<int32_t>(n);
    }
  }
  features.track_of.reserve(graph.part_of.size());
  for (const int32_t part : graph.part_of) {
    features.track_of.push_back(part < 0 ? -1 : track_of_part[part]);
  }
  return features;
}

Features FindFeatures(const Surface& surface, const TrackOptions& options) {
  Features features = FindTrackFeatures(surface, options);
  features.extrema = FindExtrema(surface);
  features.obstacles = FindObstacles(surface);
  return features;
}

FeaturesOfPair FindFeatures(const Surface& source, const Surface& target,
                            const TrackOptions& options, const parallel::Arena& arena) {
  FeaturesOfPair features;
  arena.Run(6, [&](int64_t n) {  // the longest first
    const Surface& surface = n % 2 == 0 ? source : target;
    Features& found = n % 2 == 0 ? features.source : features.target;
    if (n < 2) {
      found.extrema = FindExtrema(surface);
    } else if (n < 4) {
      Features tracks = FindTrackFeatures(surface, options);
      found.tracks = std::move(tracks.tracks);
      found.track_of = std::move(tracks.track_of);
      found.lumps = std::move(tracks.lumps);
      found.up = tracks.up;
    } else {
      found.obstacles = FindObstacles(surface);
    }
  });
  return features;
}

std::vector<AutomaticCorrespondence> FindAutomatic(const Surface& source, const Surface& target,
                                                   const FeaturesOfPair& features,
                                                   const FeaturePairs& pairs,
                                                   const std::vector<Correspondence>& users,
                                                   double edge_length_m,
                                                   const parallel::Arena& arena) {
  std::vector<AutomaticCorrespondence> result;
  const std::vector<PairedPoints> found =
      PointsOfPairs(source, target, features, pairs, users, edge_length_m, arena);
  if (found.empty()) return result;
  const OnSurface on_source(source, arena), on_target(target, arena);
  for (const PairedPoints& pair : found) {
    for (const EventPair& point : pair.points) {
      if (!on_source(point.source) || !on_target(point.target)) continue;
      AutomaticCorrespondence& added = result.emplace_back();
      added.correspondence.kind = pair.kind;
      added.correspondence.source = FromUnits(point.source, edge_length_m);
      added.correspondence.target = FromUnits(point.target, edge_length_m);
      added.confidence = pair.confidence;
    }
  }
  return result;
}

}  // namespace liquidblend::registration
