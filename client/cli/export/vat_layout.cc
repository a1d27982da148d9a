#include "client/cli/export/vat_layout.h"

#include <algorithm>

#include "absl/strings/str_cat.h"

namespace liquidblend::cli {

absl::StatusOr<VatLayout> FitVatLayout(int64_t num_frames, int64_t num_items,
                                       const std::string& what, int64_t max_size) {
  const int64_t count = std::max<int64_t>(num_items, 1);
  int64_t best_rows = 0, best_side = max_size + 1;
  for (int64_t rows = 1; rows * num_frames <= max_size; ++rows) {
    const int64_t side = std::max((count + rows - 1) / rows, rows * num_frames);
    if (side >= best_side) continue;
    best_side = side;
    best_rows = rows;
  }
  if (best_rows == 0) {
    return absl::InvalidArgumentError(absl::StrCat(
        "--format vat: ", num_frames, " frames of up to ", num_items, " ", what,
        " do not fit into a texture of ", max_size, " x ", max_size,
        "; use a coarser level (--lod), fewer frames (--fps), or --texture-size up to 16384 if the "
        "player's GPU has that"));
  }
  return VatLayout{static_cast<int>((count + best_rows - 1) / best_rows),
                   static_cast<int>(best_rows), static_cast<int>(best_rows * num_frames)};
}

}  // namespace liquidblend::cli
