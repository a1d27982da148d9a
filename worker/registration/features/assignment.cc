#include "worker/registration/features/assignment.h"

#include <cassert>
#include <limits>

namespace liquidblend::registration {
namespace {

constexpr double kNoCost = 1e-9;  // so that pairs without any have a confidence

struct Solution {
  double total = 0.0;
  std::vector<int> column;  // per row; -1: none
};

// All subsets of columns: best[row][used] is the cost of the rows from `row` on.
Solution Solve(const Eigen::MatrixXd& cost, double rejection) {
  const int rows = static_cast<int>(cost.rows()), columns = static_cast<int>(cost.cols());
  const int subsets = 1 << columns;
  std::vector<std::vector<double>> best(rows + 1, std::vector<double>(subsets, 0.0));
  std::vector<std::vector<int>> choice(rows, std::vector<int>(subsets, -1));
  for (int row = rows - 1; row >= 0; --row) {
    for (int used = 0; used < subsets; ++used) {
      best[row][used] = best[row + 1][used] + rejection;
      for (int column = 0; column < columns; ++column) {
        if ((used >> column & 1) != 0) continue;
        const double total = cost(row, column) + best[row + 1][used | 1 << column];
        if (!(total < best[row][used])) continue;
        best[row][used] = total;
        choice[row][used] = column;
      }
    }
  }
  Solution solution{best[0][0], {}};
  int used = 0;
  for (int row = 0; row < rows; ++row) {
    const int column = choice[row][used];
    solution.column.push_back(column);
    if (column >= 0) used |= 1 << column;
  }
  return solution;
}

}  // namespace

std::vector<AssignedPair> Assign(const Eigen::MatrixXd& cost, double rejection) {
  assert(cost.rows() <= kMaxAssigned && cost.cols() <= kMaxAssigned);
  std::vector<AssignedPair> pairs;
  const Solution solution = Solve(cost, rejection);
  for (int row = 0; row < cost.rows(); ++row) {
    const int column = solution.column[row];
    if (column < 0) continue;
    Eigen::MatrixXd without = cost;
    without(row, column) = std::numeric_limits<double>::infinity();
    const double margin = Solve(without, rejection).total - solution.total;
    pairs.push_back({row, column, margin / (margin + cost(row, column) + kNoCost)});
  }
  return pairs;
}

}  // namespace liquidblend::registration
