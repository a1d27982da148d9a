// A registration's state <-> matcher and maps of the iterations. Internal to worker/registration.
#pragma once

#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "worker/registration/fit/deformation.h"
#include "worker/registration/fit/match.h"
#include "worker/registration/fit/state.h"

namespace liquidblend::registration {

IterationState StateAfter(const IterationReport& last, const std::vector<NodeMap>& maps,
                          const Matcher& matcher, absl::Time start);

// Brings matcher and maps into the state. Requires: the matcher has not been used.
// Errors: kFailedPrecondition if it is the state of another registration.
absl::StatusOr<IterationReport> Resume(const RegistrationState& state, int num_iterations,
                                       Matcher& matcher, std::vector<NodeMap>& maps);

// Errors: kFailedPrecondition if it is not a state of the fine source.
absl::Status CheckResumable(const SharpenState& state, int64_t num_vertices);

// The time at which the iterations would have begun without an interruption.
absl::Time StartOf(const RegistrationState* resumed);

}  // namespace liquidblend::registration
