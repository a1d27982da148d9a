#include "worker/registration/features/rest.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "worker/registration/features/free_fall.h"

namespace liquidblend::registration {
namespace {

// The motion of a part that does not fall from rest: a predicate, "moves sideways".
using Other = std::string;
// A part that stays where it is, or whose course is too short.
struct Unknown {};

std::variant<Unknown, Other, FreeFall> CourseOfPart(const Track& track, mesh::Up up,
                                                    const RestOptions& options) {
  const std::optional<FreeFall> fall = FitFreeFall(track, up);
  if (!fall || fall->moved() < options.min_fall) return Unknown();
  if (!(fall->acceleration > 0)) return Other("does not speed up downwards");
  if (fall->peak_time > options.tolerance) {
    return absl::StrFormat("is at its highest only %.1f frames after it", fall->peak_time);
  }
  if (-fall->peak_time > options.max_age * fall->frames) return Other("falls at a steady speed");
  if (fall->drift > options.max_drift * fall->fallen + options.max_drift_edges) {
    return absl::StrFormat("moves sideways, by %.1f mean edges while it falls by %.1f", fall->drift,
                           fall->fallen);
  }
  if (fall->error > options.max_error * fall->fallen + options.max_error_edges) {
    return absl::StrFormat("does not fall freely: its height is off by %.2f mean edges",
                           fall->error);
  }
  return *fall;
}

// The falls of one animation.
struct Falls {
  std::vector<FreeFall> falls;
  // Predicate of the first part that does not fall from rest; empty: there is none.
  std::string against;
};

Falls FallsOf(const Features& features, const RestOptions& options) {
  Falls result;
  for (const Track& track : features.tracks) {
    const bool is_bubble = !(track.volume > 0);
    if (track.start != TrackStart::kFirstFrame || track.is_pre_roll() || is_bubble) continue;
    const auto course = CourseOfPart(track, features.up, options);
    if (const FreeFall* const fall = std::get_if<FreeFall>(&course)) result.falls.push_back(*fall);
    const Other* const other = std::get_if<Other>(&course);
    if (other != nullptr && result.against.empty()) result.against = *other;
  }
  return result;
}

std::string SpeakingAgainst(const Falls& falls, const char* whose) {
  if (!falls.against.empty()) {
    return absl::StrCat("a detached part of the ", whose, "'s first frame ", falls.against);
  }
  if (falls.falls.empty()) {
    return absl::StrCat("no detached part of the ", whose, "'s first frame falls");
  }
  return "";
}

std::string Disagreement(const std::vector<FreeFall>& falls, const RestOptions& options) {
  const auto [first, last] = std::minmax_element(
      falls.begin(), falls.end(),
      [](const FreeFall& a, const FreeFall& b) { return a.peak_time < b.peak_time; });
  if (last->peak_time - first->peak_time > options.tolerance) {
    return absl::StrFormat("the falling parts were at rest at different times, %.1f frames apart",
                           last->peak_time - first->peak_time);
  }
  double slowest = std::numeric_limits<double>::infinity(), fastest = 0;
  for (const FreeFall& fall : falls) {
    if (fall.bend() < options.min_bend) continue;
    slowest = std::min(slowest, fall.acceleration);
    fastest = std::max(fastest, fall.acceleration);
  }
  const double ratio = fastest / slowest;
  if (ratio > options.max_gravity_ratio) {
    return absl::StrFormat("gravity differs between the falling parts, by a factor of %.2f", ratio);
  }
  return "";
}

}  // namespace

mesh::RestReport FindRest(const Features& source, const Features& target,
                          const JoinedTracks& joined, const RestOptions& options) {
  const Falls of_source = FallsOf(source, options), of_target = FallsOf(target, options);
  mesh::RestReport report;
  // Where the target's parts rest in the source's pre-roll, the target's falls decide.
  const bool is_in_pre_roll =
      std::any_of(joined.target.begin(), joined.target.end(),
                  [](const JoinedTrack& track) { return track.pre_roll_track >= 0; });
  if (!is_in_pre_roll || !of_source.against.empty()) {
    report.reason = SpeakingAgainst(of_source, "source");
  }
  if (report.reason.empty()) report.reason = SpeakingAgainst(of_target, "target");
  if (!report.reason.empty()) return report;
  std::vector<FreeFall> all = of_source.falls;
  all.insert(all.end(), of_target.falls.begin(), of_target.falls.end());
  report.reason = Disagreement(all, options);
  if (!report.reason.empty()) return report;
  double sum = 0;
  for (const FreeFall& fall : all) sum += fall.peak_time;
  const double mean = sum / static_cast<double>(all.size());
  report.is_from_rest = true;
  report.time_frames = std::abs(mean) <= options.tolerance ? 0.0 : mean;
  report.reason =
      absl::StrCat("detached parts of the first frames fall from rest: ", of_source.falls.size(),
                   " of the source, ", of_target.falls.size(), " of the target");
  return report;
}

}  // namespace liquidblend::registration
