// Which of some things belongs to which of some others, and how sure that is. Internal to
// worker/registration.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace liquidblend::registration {

struct AssignedPair {
  int row = 0;
  int column = 0;
  // 1 - own cost / (own cost + what all costs would rise by without this pair): 0 if another
  // assignment is as good, near 1 if none comes close.
  double confidence = 0.0;
};

inline constexpr int kMaxAssigned = 12;  // rows, columns

// The pairs, each row and column in one at most, of the least total cost, where each row without a
// pair costs `rejection`; in the order of rows. An infinite cost forbids a pair.
// Requires: at most kMaxAssigned rows and columns; costs >= 0.  Cost: O(rows^2 2^columns columns).
std::vector<AssignedPair> Assign(const Eigen::MatrixXd& cost, double rejection);

}  // namespace liquidblend::registration
