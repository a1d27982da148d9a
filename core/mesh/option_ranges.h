// Ranges of the options of imports and space-time meshes. The server refuses values outside of them
// in requests; the worker's stages check them again.
#pragma once

#include <algorithm>
#include <cmath>

#include "absl/status/status.h"

namespace liquidblend::mesh {

// A closed range of values.
struct Range {
  double min, max;
  constexpr bool Holds(double value) const { return value >= min && value <= max; }  // not a NaN
};

// Checks that the value is in the range. Errors: kInvalidArgument "NAME is VALUE, not in [MIN,
// MAX]".
absl::Status CheckRange(const char* name, double value, const Range& range);

// Frame rates of an animation: from a frame every 1000 s to one every microsecond.
inline constexpr Range kFramesPerSecond = {1e-3, 1e6};

// Whether animations of these rates can be registered to one another. 23.976 counts as 24.
inline bool IsSameFrameRate(double one, double other) {
  return std::abs(one - other) <= 1.1e-3 * std::max(one, other);
}

// Ranges of the options of space-time meshes; those of the registration are in
// registration_options.h.
inline constexpr Range kSpacingEdges = {0.25, 4};
inline constexpr Range kDropletVertices = {0, 10'000};
inline constexpr Range kSheetThicknessEdges = {0, 16};
inline constexpr Range kCoarserLevels = {0, 6};

// Range of a family's rest time: when the liquid was at rest, seconds since the first frame
// (time_axis.h).
inline constexpr Range kRestTimeS = {-3600, 0};

// Defaults of the spacing, in mean edge lengths, and of the number of coarser levels of detail.
inline constexpr double kDefaultSpacingEdges = 0.9;
inline constexpr int kDefaultCoarserLevels = 2;

// The spacing of a level of detail in that of level 0. Vertices are as many as grid cells that the
// surface meets in each frame, so each level has half of those of the one before.
inline double LevelSpacing(int level) { return std::exp2(0.5 * level); }

}  // namespace liquidblend::mesh
