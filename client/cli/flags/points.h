// Points in parameter space from the command line.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "liquidblend/family.h"

namespace liquidblend::cli {

// {"drops-a:height=1,width=2", ...}, one per animation of the request, in any order -> their
// points, in the request's order; the names are in the first one's order. Nothing for none. Errors:
// kInvalidArgument, names the animation and the missing or wrong part.
absl::StatusOr<ParameterSpace> ParsePoints(const std::vector<std::string>& texts,
                                           const RegisterRequest& request);

}  // namespace liquidblend::cli
