// The assignment problem, with a confidence for each pair. Internal to worker/registration.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace liquidblend::registration {

struct AssignedPair {
  int row = 0;
  int column = 0;
  // 1 - own cost / (own cost + rise of the total cost without this pair): 0 if another assignment
  // is as good, near 1 if all others are much worse.
  double confidence = 0.0;
};

inline constexpr int kMaxAssigned = 12;  // rows, columns

// The assignment of least total cost: pairs with each row and column in one at most, in the order
// of rows. Each row without a pair costs `rejection`. An infinite cost forbids a pair.
// Requires: at most kMaxAssigned rows and columns; costs >= 0.  Cost: O(rows^2 2^columns columns).
std::vector<AssignedPair> Assign(const Eigen::MatrixXd& cost, double rejection);

}  // namespace liquidblend::registration
