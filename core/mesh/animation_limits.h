// Limits of animations. The cost of later stages follows from them, and floats are precise enough
// within them.
#pragma once

#include "absl/status/status.h"
#include "core/mesh/animation.h"

namespace liquidblend::mesh {

inline constexpr double kLongestTime = 100'000;  // frames from the first frame to the last one
// The longest gap between successive frames. Registrations of animations with longer gaps may fail,
// as the surface says too little about the time between.
inline constexpr double kLongestGap = 250;
inline constexpr double kLargestExtentEdges =
    1e6;  // mean edge lengths; of a coordinate's absolute value

// The smallest step from the frame before to a frame at `time`, both in frames: at least 0.001, and
// 8 to 16 times the resolution of a float there.
double SmallestStep(double time);

// Checks the times of the frames. Errors: kInvalidArgument, if successive frames are not
// SmallestStep() to kLongestGap apart or the last one comes after kLongestTime; the message has the
// index of the frame, its time and the limit.
absl::Status CheckTimes(const Animation& animation);

// Checks the coordinates of the frames. Errors: kInvalidArgument, if a coordinate exceeds
// kLargestExtentEdges mean edge lengths, where grids of the surface are too large and floats too
// coarse; the message has the frame, the coordinate and the limit.
absl::Status CheckExtent(const Animation& animation);

}  // namespace liquidblend::mesh
