#include "worker/registration/features/tracks.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>

#include "worker/registration/features/median.h"

namespace liquidblend::registration {
namespace {

constexpr double kSameVolume = 1.5;       // ratio within which a part is the one of before the gap
constexpr double kMinSameDistance = 2.0;  // edges; likewise for its place, or half its diameter

struct Neighbors {
  std::vector<std::vector<int32_t>> before, after;  // per part
};

Neighbors NeighborsOf(const PartGraph& graph) {
  Neighbors result{std::vector<std::vector<int32_t>>(graph.parts.size()),
                   std::vector<std::vector<int32_t>>(graph.parts.size())};
  for (const PartLink& link : graph.links) {
    result.after[link.from].push_back(link.to);
    result.before[link.to].push_back(link.from);
  }
  return result;
}

// The one of them that is as large as all others together and more; -1: none.
int32_t Dominant(const PartGraph& graph, const std::vector<int32_t>& of, double share) {
  int64_t sum = 0;
  for (const int32_t p : of) sum += graph.parts[p].num_vertices;
  for (const int32_t p : of) {
    const double size = static_cast<double>(graph.parts[p].num_vertices);
    if (size > share * static_cast<double>(sum)) return p;
  }
  return -1;
}

void Measure(Track& track) {
  std::vector<double> volumes;
  for (const Part& part : track.parts) volumes.push_back(part.volume);
  track.volume = Median(std::move(volumes));
}

// Every part belongs to one chain, whatever its size.
std::vector<Track> Chains(const PartGraph& graph, int num_frames, double dominant_share) {
  const Neighbors neighbors = NeighborsOf(graph);
  const int64_t count = static_cast<int64_t>(graph.parts.size());
  std::vector<int32_t> next(count, -1);
  std::vector<char> has_previous(count, 0);
  for (int32_t p = 0; p < count; ++p) {
    const int32_t q = Dominant(graph, neighbors.after[p], dominant_share);
    if (q < 0 || Dominant(graph, neighbors.before[q], dominant_share) != p) continue;
    next[p] = q;
    has_previous[q] = 1;
  }
  std::vector<Track> chains;
  for (int32_t first = 0; first < count; ++first) {
    if (has_previous[first]) continue;
    Track& track = chains.emplace_back();
    int32_t last = first;
    for (int32_t p = first; p >= 0; p = next[p]) {
      track.parts.push_back(graph.parts[p]);
      last = p;
    }
    const int begin = graph.parts[first].slab - 1, end = graph.parts[last].slab;
    track.start = begin <= 0                        ? TrackStart::kFirstFrame
                  : neighbors.before[first].empty() ? TrackStart::kAppears
                                                    : TrackStart::kSplit;
    track.end = end >= num_frames - 1           ? TrackEnd::kLastFrame
                : neighbors.after[last].empty() ? TrackEnd::kVanishes
                                                : TrackEnd::kMerge;
    track.start_time = end < 0 ? begin + 1 : std::clamp<double>(begin, 0, num_frames - 1);
    track.end_time = end < 0 ? end : std::clamp<double>(end, 0, num_frames - 1);
    Measure(track);
  }
  return chains;
}

// Whether `later` is the same part after a touch of the rest.
bool GoesOnAs(const Track& earlier, const Track& later, double max_gap) {
  const double gap = later.start_time - earlier.end_time;
  if (earlier.end != TrackEnd::kMerge || later.start != TrackStart::kSplit) return false;
  if (gap < 0 || gap > max_gap || !(earlier.volume > 0) || !(later.volume > 0)) return false;
  if (std::abs(std::log(earlier.volume / later.volume)) > std::log(kSameVolume)) return false;
  const Eigen::Vector4d expected = earlier.At(later.parts.front().centre[3]).centre;
  const double distance = (expected - later.parts.front().centre).head<3>().norm();
  return distance <= std::max(kMinSameDistance, 0.5 * earlier.diameter());
}

// Chains ascend in time: what goes on is found after what it goes on from.
std::vector<Track> Stitch(std::vector<Track> chains, double max_gap) {
  std::vector<Track> tracks;
  for (Track& chain : chains) {
    const auto earlier = chain.start != TrackStart::kSplit
                             ? tracks.end()
                             : std::find_if(tracks.begin(), tracks.end(), [&](const Track& track) {
                                 return GoesOnAs(track, chain, max_gap);
                               });
    if (earlier == tracks.end()) {
      tracks.push_back(std::move(chain));
      continue;
    }
    earlier->parts.insert(earlier->parts.end(), chain.parts.begin(), chain.parts.end());
    earlier->end = chain.end;
    earlier->end_time = chain.end_time;
    Measure(*earlier);
  }
  return tracks;
}

// The liquid's volume in the slab of each part, mean over the track.
double ShareOfLiquid(const Track& track, const std::map<int, double>& liquid) {
  double own = 0, all = 0;
  for (const Part& part : track.parts) {
    own += std::max(0.0, part.volume);
    all += liquid.at(part.slab);
  }
  return all > 0 ? own / all : 1.0;
}

}  // namespace

double Track::diameter() const {
  return 2 * std::cbrt(std::max(0.0, volume) * 0.75 / std::numbers::pi);
}

Part Track::At(double time) const {
  size_t n = 1;
  while (n + 1 < parts.size() && parts[n].centre[3] < time) ++n;
  if (parts.size() < 2) return parts.front();
  const Part &a = parts[n - 1], &b = parts[n];
  const double span = b.centre[3] - a.centre[3];
  if (!(span > 0)) return a;
  // A little beyond the ends: the part goes on as it moves.
  const double f = (time - a.centre[3]) / span;
  Part result = a;
  result.centre += f * (b.centre - a.centre);
  const double inside = std::clamp(f, 0.0, 1.0);
  for (size_t k = 0; k < result.reach.size(); ++k) {
    result.reach[k] += inside * (b.reach[k] - a.reach[k]);
  }
  return result;
}

std::vector<Track> FindTracks(const PartGraph& graph, int num_frames, const TrackOptions& options) {
  std::map<int, double> liquid;
  for (const Part& part : graph.parts) liquid[part.slab] += std::max(0.0, part.volume);
  std::vector<Track> tracks =
      Stitch(Chains(graph, num_frames, options.dominant_share), options.max_gap);
  std::erase_if(tracks, [&](const Track& track) {
    const bool at_first = track.start == TrackStart::kFirstFrame;
    return track.diameter() < options.min_diameter ||
           track.life() < (at_first ? options.min_first_life : options.min_life) ||
           ShareOfLiquid(track, liquid) > options.max_share;
  });
  std::stable_sort(tracks.begin(), tracks.end(),
                   [](const Track& a, const Track& b) { return a.start_time < b.start_time; });
  return tracks;
}

}  // namespace liquidblend::registration
