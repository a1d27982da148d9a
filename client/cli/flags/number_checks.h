// Checks of the values of flags, with messages that name the given value.
#pragma once

#include <CLI/App.hpp>

namespace liquidblend::cli {

CLI::Validator Positive();                      // finite and above 0
CLI::Validator NonNegative();                   // finite, 0 or more
CLI::Validator Within(double min, double max);  // both included

}  // namespace liquidblend::cli
