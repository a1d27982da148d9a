// What the fake server answers.
#pragma once

#include <string>
#include <vector>

#include "google/longrunning/operations.pb.h"
#include "liquidblend/v1/liquidblend.pb.h"

namespace liquidblend::testing {

inline constexpr int kCannedFramesPerSecond = 24;
inline constexpr double kCannedDuration = 1.0;    // seconds
inline constexpr double kCannedMinWeight = -0.5;  // weights below are said to be clamped

v1::Animation MakeAnimation(const std::string& id);

// The family "empty" has no version yet.
v1::Family MakeFamily(const std::string& id);

// Half-way: an import if the id starts with "import", else a registration.
google::longrunning::Operation MakeOperation(const std::string& id);

// Done: failed-1 and cancelled-1 with their errors, others with what they made.
google::longrunning::Operation MakeFinished(const std::string& id);

// MakeOctahedron(weights[0], time_s), encoded.
v1::Frame MakeFrame(const std::string& family, const std::vector<double>& weights, double time_s,
                    int bits);

}  // namespace liquidblend::testing
