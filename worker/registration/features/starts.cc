#include "worker/registration/features/starts.h"

#include <algorithm>

#include "absl/strings/str_format.h"
#include "worker/registration/features/pair_features.h"

namespace liquidblend::registration {
namespace {

constexpr double kAround = 1.5;   // radii; what surrounds the part
constexpr double kBeneath = 2.0;  // radii; around where it meets the rest

std::vector<Track> FromFirstFrame(const std::vector<Track>& tracks) {
  std::vector<Track> result;
  for (const Track& track : tracks) {
    if (track.start == TrackStart::kFirstFrame) result.push_back(track);
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

OpenStarts FindOpenStarts(const std::vector<Track>& source, const std::vector<Track>& target,
                          const Surface& source_surface, const Surface& target_surface) {
  const Features from = {FromFirstFrame(source), {}}, to = {FromFirstFrame(target), {}};
  OpenStarts open;
  if (from.tracks.size() == to.tracks.size()) return open;
  const bool in_source = from.tracks.size() > to.tracks.size();
  PairOptions options;
  options.min_confidence = 0;
  const auto pairs = PairFeatures(from, to, ScaleOf(source_surface, target_surface), options);
  const std::vector<Track>& more = in_source ? from.tracks : to.tracks;
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
