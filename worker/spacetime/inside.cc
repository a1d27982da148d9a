#include "worker/spacetime/inside.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace liquidblend::spacetime {
namespace {

struct Crossing {
  int64_t row;
  double x;
  int winding;  // added to the winding number beyond x
};

// Rows are shifted a little off the grid so that they meet no vertex or edge of a mesh whose
// coordinates are special; another shift is tried where rounding still made the crossings disagree.
struct Shift {
  double y, z;
};
constexpr int kMaxShifts = 8;
Shift NthShift(int n) { return {1e-6 * (1.4142135 + 3.7 * n), 1e-6 * (0.7320508 + 2.3 * n)}; }

// Twice the signed area of (a, b, p) in the y-z plane. Evaluated from the vertex of lower index, so
// that the two triangles at an edge see exactly opposite values.
double EdgeSide(const Eigen::Matrix3Xf& vertices, int a, int b, double y, double z) {
  const bool swap = a > b;
  const int lo = swap ? b : a, hi = swap ? a : b;
  const double ay = vertices(1, lo), az = vertices(2, lo);
  const double by = vertices(1, hi), bz = vertices(2, hi);
  const double side = (by - ay) * (z - az) - (bz - az) * (y - ay);
  const double strict = side == 0.0 ? 1e-300 : side;
  return swap ? -strict : strict;
}

// Appends where the row through (y, z) crosses triangle t.
void Cross(const GridSurface& surface, int64_t t, int64_t row, double y, double z,
           std::vector<Crossing>& crossings) {
  const int a = surface.triangles(0, t), b = surface.triangles(1, t), c = surface.triangles(2, t);
  const double side_c = EdgeSide(surface.vertices, a, b, y, z);
  const double side_a = EdgeSide(surface.vertices, b, c, y, z);
  const double side_b = EdgeSide(surface.vertices, c, a, y, z);
  const bool positive = side_a > 0 && side_b > 0 && side_c > 0;
  const bool negative = side_a < 0 && side_b < 0 && side_c < 0;
  if (!positive && !negative) return;
  const double sum = side_a + side_b + side_c;
  const double x = (side_a * surface.vertices(0, a) + side_b * surface.vertices(0, b) +
                    side_c * surface.vertices(0, c)) /
                   sum;
  crossings.push_back({row, x, positive ? -1 : 1});  // positive: the normal points along +x
}

void CollectCrossings(const Grid& grid, const GridSurface& surface, Shift shift,
                      std::vector<Crossing>& crossings) {
  for (int64_t t = 0; t < surface.triangles.cols(); ++t) {
    Eigen::Matrix3f corners;
    for (int c = 0; c < 3; ++c) corners.col(c) = surface.vertices.col(surface.triangles(c, t));
    const Eigen::Vector3f lo = corners.rowwise().minCoeff(), hi = corners.rowwise().maxCoeff();
    const int j_end = std::min(grid.dims[1] - 1, static_cast<int>(std::floor(hi.y())));
    const int k_end = std::min(grid.dims[2] - 1, static_cast<int>(std::floor(hi.z())));
    for (int k = std::max(0, static_cast<int>(std::ceil(lo.z() - 1e-3f))); k <= k_end; ++k) {
      for (int j = std::max(0, static_cast<int>(std::ceil(lo.y() - 1e-3f))); j <= j_end; ++j) {
        Cross(surface, t, grid.Row(j, k), j + shift.y, k + shift.z, crossings);
      }
    }
  }
}

// Fills the bits of one row from its crossings; false if they do not cancel out.
bool FillRow(std::span<Crossing> crossings, int num_x, uint64_t* words) {
  std::sort(crossings.begin(), crossings.end(),
            [](const Crossing& a, const Crossing& b) { return a.x < b.x; });
  int winding = 0;
  for (size_t n = 0; n < crossings.size(); ++n) {
    winding += crossings[n].winding;
    if (n + 1 == crossings.size() || winding <= 0) continue;
    const int begin = std::max(0, static_cast<int>(std::floor(crossings[n].x)) + 1);
    const int end = std::min(num_x - 1, static_cast<int>(std::floor(crossings[n + 1].x)));
    for (int i = begin; i <= end; ++i) words[i >> 6] |= uint64_t{1} << (i & 63);
  }
  return winding == 0;
}

// A row whose crossings did not cancel is done again with other shifts.
void RetryRow(const Grid& grid, const GridSurface& surface, int64_t row, uint64_t* words) {
  const int j = static_cast<int>(row % grid.dims[1]), k = static_cast<int>(row / grid.dims[1]);
  for (int n = 1; n < kMaxShifts; ++n) {
    const Shift shift = NthShift(n);
    std::vector<Crossing> crossings;
    for (int64_t t = 0; t < surface.triangles.cols(); ++t) {
      Cross(surface, t, row, j + shift.y, k + shift.z, crossings);
    }
    std::fill(words, words + grid.words_per_row(), 0);
    if (FillRow(crossings, grid.dims[0], words)) return;
  }
}

}  // namespace

InsideBits ComputeInside(const Grid& grid, const GridSurface& surface) {
  InsideBits inside(grid);
  std::vector<Crossing> crossings;
  CollectCrossings(grid, surface, NthShift(0), crossings);
  std::stable_sort(crossings.begin(), crossings.end(),
                   [](const Crossing& a, const Crossing& b) { return a.row < b.row; });
  for (size_t begin = 0, end = 0; begin < crossings.size(); begin = end) {
    const int64_t row = crossings[begin].row;
    while (end < crossings.size() && crossings[end].row == row) ++end;
    uint64_t* words = inside.MutableRow(row);
    if (!FillRow({&crossings[begin], end - begin}, grid.dims[0], words)) {
      RetryRow(grid, surface, row, words);
    }
  }
  return inside;
}

}  // namespace liquidblend::spacetime
