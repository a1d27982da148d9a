#include "worker/ingest/frame_times.h"

#include <cmath>
#include <cstdint>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/mesh/animation_limits.h"

namespace liquidblend::ingest {
namespace {

// Between the frames of two files. `time` is that of the later one.
absl::Status CheckStep(const FrameFiles& before, const FrameFiles& after, double time) {
  const double step = after.number - before.number;
  const std::string frames =
      absl::StrCat("frames ", FormatNumber(before.number), " and ", FormatNumber(after.number));
  const std::string files = absl::StrCat(Escaped(*before.mesh), " and ", Escaped(*after.mesh));
  if (step < mesh::SmallestStep(time)) {
    return absl::InvalidArgumentError(absl::StrCat(
        frames, " are less than ", mesh::SmallestStep(time), " frames apart: ", files));
  }
  if (step <= mesh::kLongestGap) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(frames, " are more than ", mesh::kLongestGap, " frames apart: ", files));
}

absl::Status CheckDuration(const FrameFiles& first, const FrameFiles& last) {
  if (last.number - first.number <= mesh::kLongestTime) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(
      "frame ", FormatNumber(last.number), " comes more than ", FormatNumber(mesh::kLongestTime),
      " frames after frame ", FormatNumber(first.number), ": ", Escaped(*last.mesh)));
}

absl::Status GapError(const FrameFiles& before, const FrameFiles& after) {
  return absl::InvalidArgumentError(
      absl::StrCat("frame ", FormatNumber(before.number + 1), " is missing: ", Escaped(*after.mesh),
                   " comes right after ", Escaped(*before.mesh),
                   " (allow gaps, --allow-gaps, to go on without it)"));
}

// Times 0, 1, 2, ... are said by none.
std::vector<double> Canonical(std::vector<double> times) {
  for (size_t k = 0; k < times.size(); ++k) {
    if (times[k] != static_cast<double>(k)) return times;
  }
  return {};
}

}  // namespace

absl::Status CheckFrameTimes(std::span<const double> times, const std::string& name) {
  for (size_t k = 0; k < times.size(); ++k) {
    const std::string element = absl::StrCat(name, "[", k, "] is ", FormatNumber(times[k]));
    if (!std::isfinite(times[k]) || times[k] > mesh::kLongestTime) {
      return absl::InvalidArgumentError(
          absl::StrCat(element, ", not a time up to ", FormatNumber(mesh::kLongestTime)));
    }
    if (k == 0 && times[k] != 0.0) {
      return absl::InvalidArgumentError(absl::StrCat(element, ", but times begin with 0"));
    }
    if (k == 0) continue;
    const double step = times[k] - times[k - 1], smallest = mesh::SmallestStep(times[k]);
    if (step < smallest) {
      return absl::InvalidArgumentError(
          absl::StrCat(element, ", not above ", FormatNumber(times[k - 1]), " by ", smallest));
    }
    if (step > mesh::kLongestGap) {
      return absl::InvalidArgumentError(absl::StrCat(element, ", more than ", mesh::kLongestGap,
                                                     " above ", FormatNumber(times[k - 1])));
    }
  }
  return absl::OkStatus();
}

absl::StatusOr<FrameTimes> FindFrameTimes(const FrameSequence& sequence,
                                          const std::vector<double>& given, bool allow_gaps) {
  const std::vector<FrameFiles>& frames = sequence.frames;
  if (!given.empty() && given.size() != frames.size()) {
    return absl::InvalidArgumentError(
        absl::StrCat("frame_times has ", given.size(), " times for ", frames.size(), " frames"));
  }
  if (!given.empty()) return FrameTimes{Canonical(given), ""};
  LB_RETURN_IF_ERROR(CheckFractions(sequence));
  FrameTimes result;
  double num_missing = 0.0;
  std::string first_missing;
  for (size_t k = 0; k < frames.size(); ++k) {
    result.times.push_back(frames[k].number - frames[0].number);
    if (k == 0) continue;
    LB_RETURN_IF_ERROR(CheckDuration(frames[0], frames[k]));
    LB_RETURN_IF_ERROR(CheckStep(frames[k - 1], frames[k], result.times[k]));
    const double step = frames[k].number - frames[k - 1].number;
    if (sequence.has_fractions || step == 1.0) continue;
    if (!allow_gaps) return GapError(frames[k - 1], frames[k]);
    if (num_missing == 0.0) first_missing = FormatNumber(frames[k - 1].number + 1);
    num_missing += step - 1.0;
  }
  result.times = Canonical(std::move(result.times));
  if (sequence.has_fractions) {
    result.note =
        absl::StrCat("Took numbers as times in frames, from ", FormatNumber(frames[0].number), " (",
                     Escaped(*frames[0].mesh), ") to ", FormatNumber(frames.back().number), " (",
                     Escaped(*frames.back().mesh), ").");
  }
  if (num_missing > 0.0) {
    result.note = absl::StrCat("Frame numbers that are missing: ", FormatNumber(num_missing),
                               ", the first is ", first_missing, "; time goes on across them.");
  }
  return result;
}

}  // namespace liquidblend::ingest
