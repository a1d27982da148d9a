#include "worker/spacetime/field/inside.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "worker/spacetime/field/line_crossings.h"

namespace liquidblend::spacetime {
namespace {

// Fills the bits of one row from its crossings; false if they do not cancel out.
bool FillRow(std::span<Crossing> crossings, int num_x, uint64_t* words) {
  std::sort(crossings.begin(), crossings.end(),
            [](const Crossing& a, const Crossing& b) { return a.at < b.at; });
  int winding = 0;
  for (size_t n = 0; n < crossings.size(); ++n) {
    winding += crossings[n].winding;
    if (n + 1 == crossings.size() || winding <= 0) continue;
    const int begin = std::max(0, static_cast<int>(std::floor(crossings[n].at)) + 1);
    const int end = std::min(num_x - 1, static_cast<int>(std::floor(crossings[n + 1].at)));
    for (int i = begin; i <= end; ++i) words[i >> 6] |= uint64_t{1} << (i & 63);
  }
  return winding == 0;
}

// A row whose crossings did not cancel is done again with other shifts.
void RetryRow(const Grid& grid, const GridSurface& surface, const GridLines& rows, int64_t row,
              uint64_t* words) {
  for (int n = 1; n < kNumLineShifts; ++n) {
    std::vector<Crossing> crossings;
    for (int64_t t = 0; t < surface.triangles.cols(); ++t) {
      CrossLine(surface, t, rows, row, NthLineShift(n), crossings);
    }
    std::fill(words, words + grid.words_per_row(), 0);
    if (FillRow(crossings, grid.dims[0], words)) return;
  }
}

}  // namespace

InsideBits ComputeInside(const Grid& grid, const GridSurface& surface) {
  InsideBits inside(grid);
  const GridLines rows(grid, 0);
  std::vector<Crossing> crossings;
  for (int64_t t = 0; t < surface.triangles.cols(); ++t) {
    CrossLines(surface, t, rows, NthLineShift(0), crossings);
  }
  std::stable_sort(crossings.begin(), crossings.end(),
                   [](const Crossing& a, const Crossing& b) { return a.line < b.line; });
  for (size_t begin = 0, end = 0; begin < crossings.size(); begin = end) {
    const int64_t row = crossings[begin].line;
    while (end < crossings.size() && crossings[end].line == row) ++end;
    uint64_t* words = inside.MutableRow(row);
    if (!FillRow({&crossings[begin], end - begin}, grid.dims[0], words)) {
      RetryRow(grid, surface, rows, row, words);
    }
  }
  return inside;
}

}  // namespace liquidblend::spacetime
