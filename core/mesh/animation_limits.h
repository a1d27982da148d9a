// Limits of animations. The cost of later stages follows from them, and floats resolve what lies
// within them.
#pragma once

#include "absl/status/status.h"
#include "core/mesh/animation.h"

namespace liquidblend::mesh {

inline constexpr double kLongestTime = 100'000;  // frames from the first frame to the last one
// Frames between successive frames. Registrations of animations with longer gaps may fail, as the
// surface says too little about the time between.
inline constexpr double kLongestGap = 250;
inline constexpr double kLargestExtentEdges =
    1e6;  // mean edge lengths; of a coordinate's absolute value

// The smallest step to a frame at this time, in frames: at least 0.001, and 8 to 16 times what a
// float resolves there.
double SmallestStep(double time);

// Errors: kInvalidArgument, if successive frames are not SmallestStep() to kLongestGap apart or the
// last one comes after kLongestTime; the message holds the index of the frame, its time and the
// limit.
absl::Status CheckTimes(const Animation& animation);

// Errors: kInvalidArgument, if a coordinate exceeds kLargestExtentEdges mean edge lengths, where
// grids of the surface are too large and floats too coarse; the message holds the frame, the
// coordinate and the limit.
absl::Status CheckExtent(const Animation& animation);

}  // namespace liquidblend::mesh
