// Median of a few values. Internal to worker/registration.
#pragma once

#include <algorithm>
#include <vector>

namespace liquidblend::registration {

// The upper one of the two middle values if their number is even. Requires: values is not empty.
inline double Median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace liquidblend::registration
