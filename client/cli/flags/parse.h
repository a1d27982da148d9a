// Parsers of the flags' values that CLI11 does not parse itself.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"

namespace liquidblend::cli {

// "0.25,-0.5" -> {0.25, -0.5}.  Errors: kInvalidArgument, names `flag` and the bad part.
absl::StatusOr<std::vector<double>> ParseNumbers(const std::string& flag, const std::string& text);

// "wall_width=0.5,drop_height=1" -> the names and their values, in this order.
// Errors: kInvalidArgument, names `flag` and the bad part.
absl::StatusOr<std::vector<std::pair<std::string, double>>> ParseAssignments(
    const std::string& flag, const std::string& text);

// {0.25, -0.5} -> "0.25, -0.5"
std::string FormatNumbers(const std::vector<double>& numbers);

}  // namespace liquidblend::cli
