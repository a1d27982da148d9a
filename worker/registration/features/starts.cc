#include "worker/registration/features/starts.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_format.h"

namespace liquidblend::registration {
namespace {

constexpr double kAround = 1.5;   // radii; what surrounds the part
constexpr double kBeneath = 2.0;  // radii; around where it meets the rest

// The tracks from the first frame on, by whether they are joined with the rest in the other
// animation.
struct FirstTracks {
  std::vector<Track> joined, others;
};

FirstTracks FromFirstFrame(const std::vector<Track>& tracks,
                           const std::vector<JoinedTrack>& joined) {
  FirstTracks result;
  for (int n = 0; n < static_cast<int>(tracks.size()); ++n) {
    if (tracks[n].start != TrackStart::kFirstFrame || tracks[n].is_pre_roll()) continue;
    const auto found = std::find_if(joined.begin(), joined.end(),
                                    [n](const JoinedTrack& j) { return j.track == n; });
    if (found == joined.end()) {
      result.others.push_back(tracks[n]);
    } else if (found->pre_roll_track < 0) {
      result.joined.push_back(tracks[n]);
    }
  }
  return result;
}

Eigen::Vector3d OffsetFrom(const Part& part, const Eigen::Vector4f& point) {
  return point.head<3>().cast<double>() - part.centre.head<3>();
}

// The part with what is around it, and with what it is about to strike.
bool IsAroundPart(const Track& track, const Eigen::Vector4f& point) {
  if (point[3] > track.end_time) return false;
  const Part now = track.At(point[3]), last = track.At(track.end_time);
  return OffsetFrom(now, point).norm() <= kAround * now.radius() ||
         OffsetFrom(last, point).norm() <= kBeneath * last.radius();
}

void Append(const std::vector<Track>& tracks, const char* whose, const char* others,
            double edge_length_m, std::string& text) {
  for (const Track& track : tracks) {
    const Eigen::Vector3d place = edge_length_m * track.parts.front().centre.head<3>();
    absl::StrAppendFormat(&text,
                          "; a part of the %s at (%.2f, %.2f, %.2f) m is apart from frame 0 to "
                          "%.0f, but not in the first frame of the %s",
                          whose, place.x(), place.y(), place.z(), track.end_time, others);
  }
}

}  // namespace

OpenStarts FindOpenStarts(const Features& source, const Features& target, const SceneScale& scale) {
  const JoinedTracks joined = FindJoinedTracks(source, target, scale);
  FirstTracks from = FromFirstFrame(source.tracks, joined.source);
  FirstTracks to = FromFirstFrame(target.tracks, joined.target);
  OpenStarts open = {std::move(from.joined), std::move(to.joined)};
  if (from.others.size() == to.others.size()) return open;
  const bool in_source = from.others.size() > to.others.size();
  PairOptions options;
  options.min_confidence = 0;
  const auto pairs = PairFeatures({from.others, {}}, {to.others, {}}, scale, options);
  const std::vector<Track>& more = in_source ? from.others : to.others;
  for (int n = 0; n < static_cast<int>(more.size()); ++n) {
    const bool is_paired =
        std::any_of(pairs.tracks.begin(), pairs.tracks.end(),
                    [&](const AssignedPair& p) { return (in_source ? p.row : p.column) == n; });
    if (!is_paired) (in_source ? open.source : open.target).push_back(more[n]);
  }
  return open;
}

std::vector<char> VerticesOf(const OpenStarts& starts, const Surface& source) {
  std::vector<char> open;
  if (starts.source.empty()) return open;
  open.resize(source.points.cols());
  for (int64_t v = 0; v < source.points.cols(); ++v) {
    open[v] = std::any_of(starts.source.begin(), starts.source.end(), [&](const Track& track) {
      return IsAroundPart(track, source.points.col(v));
    });
  }
  return open;
}

std::string Describe(const OpenStarts& starts, double edge_length_m) {
  std::string text;
  Append(starts.source, "source", "target", edge_length_m, text);
  Append(starts.target, "target", "source", edge_length_m, text);
  return text;
}

}  // namespace liquidblend::registration
