#include "worker/registration/features/pair_features.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace liquidblend::registration {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kRejection = 1.0;  // what being without a partner costs

// The numbers of the kMaxAssigned strongest, ascending; ties to the lower number.
template <typename Strength>
std::vector<int> Strongest(size_t size, const Strength& strength) {
  std::vector<int> order(size);
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return strength(a) > strength(b); });
  order.resize(std::min<size_t>(size, kMaxAssigned));
  std::sort(order.begin(), order.end());
  return order;
}

double Square(double value) { return value * value; }

// Mean of the squares of differences, each over its limit; infinite beyond a limit.
class CostMean {
 public:
  void Add(double difference, double limit) {
    const double share = std::abs(difference) / limit;
    ++count_;
    sum_ = share <= 1 ? sum_ + Square(share) : kInfinity;
  }
  double mean() const { return sum_ / count_; }

 private:
  double sum_ = 0.0;
  int count_ = 0;
};

// Tracks from the first frame on: nothing says better where they are to be expected than each
// other.
double FirstTrackCost(const Track& a, const Track& b, const SceneScale& scale,
                      const PairOptions& options) {
  if (a.start != TrackStart::kFirstFrame || b.start != TrackStart::kFirstFrame) return kInfinity;
  if (a.is_pre_roll()) return kInfinity;
  const double common = std::min(a.life(), b.life());
  const bool alike = a.end == b.end;
  CostMean cost;
  const auto add_distance = [&](double time_a, double time_b) {
    cost.Add((a.At(time_a).centre - b.At(time_b).centre).head<3>().norm(),
             options.max_shift * scale.length);
  };
  add_distance(0, 0);
  add_distance(alike ? a.end_time : common, alike ? b.end_time : common);
  if (alike) cost.Add(a.life() - b.life(), options.max_lead * scale.frames);
  cost.Add(std::log(a.volume / b.volume), std::log(options.max_volume_ratio));
  return cost.mean();
}

// Places and times of a paired track's merge in both animations.
struct Merge {
  Eigen::Vector4d source, target;
  int height_axis = 2;
};

// Expected place of the source's event in the target: moved like the last merge before it, or
// unmoved without one.
Eigen::Vector4d AfterMerges(const Eigen::Vector4d& event, const std::vector<Merge>& merges) {
  const Merge* last = nullptr;
  for (const Merge& merge : merges) {
    if (merge.source[3] > event[3]) continue;
    if (last == nullptr || merge.source[3] > last->source[3]) last = &merge;
  }
  if (last == nullptr) return event;
  Eigen::Vector4d move = last->target - last->source;
  move[last->height_axis] = 0;  // heights are the surface's own
  return event + move;
}

void AddEvents(const Eigen::Vector4d& expected, const Eigen::Vector4d& found,
               const SceneScale& scale, const PairOptions& options, CostMean& cost) {
  const Eigen::Vector4d difference = found - expected;
  cost.Add(difference.head<3>().norm(), options.max_event_shift * scale.length);
  cost.Add(difference[3], options.max_event_lead * scale.frames);
}

Eigen::Vector4d EventOf(const Track& track, double time) {
  Eigen::Vector4d event = track.At(time).centre;
  event[3] = time;
  return event;
}

// Tracks that begin later, such as splashes.
double LaterTrackCost(const Track& a, const Track& b, const std::vector<Merge>& merges,
                      const SceneScale& scale, const PairOptions& options) {
  if (a.start == TrackStart::kFirstFrame || a.start != b.start || a.end != b.end) return kInfinity;
  CostMean cost;
  AddEvents(AfterMerges(EventOf(a, a.start_time), merges), EventOf(b, b.start_time), scale, options,
            cost);
  AddEvents(AfterMerges(EventOf(a, a.end_time), merges), EventOf(b, b.end_time), scale, options,
            cost);
  cost.Add(std::log(a.volume / b.volume), std::log(options.max_volume_ratio));
  return cost.mean();
}

double ExtremumCost(const Extremum& a, const Extremum& b, const std::vector<Merge>& merges,
                    const SceneScale& scale, const PairOptions& options) {
  if (a.kind != b.kind) return kInfinity;
  CostMean cost;
  AddEvents(AfterMerges(a.point, merges), b.point, scale, options, cost);
  cost.Add(std::log(a.persistence / b.persistence), std::log(options.max_persistence_ratio));
  return cost.mean();
}

double ObstacleCost(const Obstacle& a, const Obstacle& b, const SceneScale& scale,
                    const PairOptions& options) {
  CostMean cost;
  cost.Add((a.box.center() - b.box.center()).norm(), options.max_obstacle_shift * scale.length);
  cost.Add(std::log(a.box.diagonal().norm() / b.box.diagonal().norm()),
           std::log(options.max_obstacle_ratio));
  return cost.mean();
}

// Pairs of rows and columns as numbers of the features themselves.
std::vector<AssignedPair> Renumber(std::vector<AssignedPair> pairs, const std::vector<int>& rows,
                                   const std::vector<int>& columns, double min_confidence) {
  std::erase_if(pairs, [&](const AssignedPair& p) { return !(p.confidence >= min_confidence); });
  for (AssignedPair& pair : pairs) {
    pair.row = rows[pair.row];
    pair.column = columns[pair.column];
  }
  return pairs;
}

template <typename Cost>
std::vector<AssignedPair> AssignChosen(const std::vector<int>& rows,
                                       const std::vector<int>& columns, double min_confidence,
                                       const Cost& cost) {
  Eigen::MatrixXd costs(rows.size(), columns.size());
  for (Eigen::Index i = 0; i < costs.rows(); ++i) {
    for (Eigen::Index j = 0; j < costs.cols(); ++j) costs(i, j) = cost(rows[i], columns[j]);
  }
  return Renumber(Assign(costs, kRejection), rows, columns, min_confidence);
}

std::vector<Merge> MergesOf(const Features& source, const Features& target,
                            const std::vector<AssignedPair>& pairs) {
  const int height_axis = mesh::AxisOf(source.up).axis;
  std::vector<Merge> merges;
  for (const AssignedPair& pair : pairs) {
    const Track &a = source.tracks[pair.row], &b = target.tracks[pair.column];
    if (a.end != TrackEnd::kMerge || b.end != TrackEnd::kMerge) continue;
    Merge merge{a.At(a.end_time).centre, b.At(b.end_time).centre, height_axis};
    merge.source[3] = a.end_time;
    merge.target[3] = b.end_time;
    merges.push_back(merge);
  }
  return merges;
}

// Whether two events come in the same order in both animations.
bool SameOrder(double source_a, double target_a, double source_b, double target_b) {
  return (source_a - source_b) * (target_a - target_b) >= 0;
}

std::vector<AssignedPair> KeepOrdered(std::vector<AssignedPair> pairs, const Features& source,
                                      const Features& target, const std::vector<Merge>& merges) {
  std::stable_sort(pairs.begin(), pairs.end(), [](const AssignedPair& a, const AssignedPair& b) {
    return a.confidence > b.confidence;
  });
  std::vector<AssignedPair> kept;
  const auto times = [&](const AssignedPair& p) {
    return std::array{source.extrema[p.row].point[3], target.extrema[p.column].point[3]};
  };
  for (const AssignedPair& pair : pairs) {
    const auto at = times(pair);
    const bool after_merges = std::all_of(merges.begin(), merges.end(), [&](const Merge& m) {
      return SameOrder(at[0], at[1], m.source[3], m.target[3]);
    });
    const bool in_order = std::all_of(kept.begin(), kept.end(), [&](const AssignedPair& other) {
      return SameOrder(at[0], at[1], times(other)[0], times(other)[1]);
    });
    if (after_merges && in_order) kept.push_back(pair);
  }
  std::sort(kept.begin(), kept.end(),
            [](const AssignedPair& a, const AssignedPair& b) { return a.row < b.row; });
  return kept;
}

// Exchanges the partners of those two pairs where the total cost, of cost(row, column), rises
// least. Where no exchange has a cost, all stay.
template <typename Cost>
void ExchangeCheapest(const Cost& cost, std::vector<AssignedPair>& pairs) {
  double least = kInfinity;
  std::pair<size_t, size_t> best;
  for (size_t a = 0; a < pairs.size(); ++a) {
    for (size_t b = a + 1; b < pairs.size(); ++b) {
      const double rise = cost(pairs[a].row, pairs[b].column) +
                          cost(pairs[b].row, pairs[a].column) -
                          cost(pairs[a].row, pairs[a].column) - cost(pairs[b].row, pairs[b].column);
      if (!(rise < least)) continue;
      least = rise;
      best = {a, b};
    }
  }
  if (least < kInfinity) std::swap(pairs[best.first].column, pairs[best.second].column);
}

}  // namespace

SceneScale ScaleOf(const Surface& source, const Surface& target) {
  const Eigen::Vector4f low =
      source.points.rowwise().minCoeff().cwiseMin(target.points.rowwise().minCoeff());
  const Eigen::Vector4f high =
      source.points.rowwise().maxCoeff().cwiseMax(target.points.rowwise().maxCoeff());
  return {std::max(1.0, static_cast<double>((high - low).head<3>().norm())),
          std::max(1.0, source.mesh.num_frames - 1.0)};
}

JoinedTracks FindJoinedTracks(const Features& source, const Features& target,
                              const SceneScale& scale, const PairOptions& options) {
  std::vector<AssignedPair> pairs =
      PairLumps(source.lumps, target.lumps, options.max_shift * scale.length);
  const TracksWithLumps a{source.tracks, source.lumps}, b{target.tracks, target.lumps};
  JoinedTracks joined;
  joined.source = FindJoinedTracks(a, b, pairs, source.up, options.min_confidence);
  for (AssignedPair& pair : pairs) std::swap(pair.row, pair.column);
  joined.target = FindJoinedTracks(b, a, pairs, source.up, options.min_confidence);
  return joined;
}

FeaturePairs PairFeatures(const Features& source, const Features& target, const SceneScale& scale,
                          const PairOptions& options) {
  const auto tracks_of = [](const Features& f) {
    return Strongest(f.tracks.size(), [&](int n) { return f.tracks[n].volume; });
  };
  const auto extrema_of = [](const Features& f) {
    return Strongest(f.extrema.size(), [&](int n) { return f.extrema[n].persistence; });
  };
  const auto obstacles_of = [](const Features& f) {
    return Strongest(f.obstacles.size(), [&](int n) { return f.obstacles[n].contacts.size(); });
  };
  const std::vector<int> rows = tracks_of(source), columns = tracks_of(target);
  FeaturePairs pairs;
  pairs.joined = FindJoinedTracks(source, target, scale, options);
  const auto first_cost = [&](int a, int b) {
    if (IsJoined(pairs.joined.source, a) || IsJoined(pairs.joined.target, b)) return kInfinity;
    return FirstTrackCost(source.tracks[a], target.tracks[b], scale, options);
  };
  pairs.tracks = AssignChosen(rows, columns, options.min_confidence, first_cost);
  if (options.exchange) ExchangeCheapest(first_cost, pairs.tracks);
  const std::vector<Merge> merges = MergesOf(source, target, pairs.tracks);
  const auto later = AssignChosen(rows, columns, options.min_confidence, [&](int a, int b) {
    return LaterTrackCost(source.tracks[a], target.tracks[b], merges, scale, options);
  });
  pairs.tracks.insert(pairs.tracks.end(), later.begin(), later.end());
  pairs.extrema =
      KeepOrdered(AssignChosen(extrema_of(source), extrema_of(target), options.min_confidence,
                               [&](int a, int b) {
                                 return ExtremumCost(source.extrema[a], target.extrema[b], merges,
                                                     scale, options);
                               }),
                  source, target, merges);
  pairs.obstacles = AssignChosen(
      obstacles_of(source), obstacles_of(target), options.min_confidence, [&](int a, int b) {
        return ObstacleCost(source.obstacles[a], target.obstacles[b], scale, options);
      });
  return pairs;
}

}  // namespace liquidblend::registration
