// Times of the frames.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "worker/ingest/frame_files.h"

namespace liquidblend::ingest {

struct FrameTimes {
  std::vector<double>
      times;         // frames since the first; empty: 0, 1, 2, ... (mesh::Animation::times)
  std::string note;  // one sentence, if numbers are missing or have fractions; or empty
};

// OK if there are none, or they rise from 0 within the limits of core/mesh/animation_limits.h:
// kLongestTime, kLongestGap, SmallestStep().
// Errors: kInvalidArgument with the first time at fault; the message begins with `name`.
absl::Status CheckFrameTimes(std::span<const double> times, const std::string& name);

// `given` if there are some, one per frame; else the frames' numbers, where a whole number may be
// missing only if allow_gaps, and numbers with fractions must pass CheckFractions(). The same
// limits hold for numbers. Requires: CheckFrameTimes(given).  Errors: kInvalidArgument, naming the
// frames and the limit.
absl::StatusOr<FrameTimes> FindFrameTimes(const FrameSequence& sequence,
                                          const std::vector<double>& given, bool allow_gaps);

}  // namespace liquidblend::ingest
