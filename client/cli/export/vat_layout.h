// Layout of vertex animation textures: which texel holds which item of which frame.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"

namespace liquidblend::cli {

// Item i of frame f lies in column i % width of row f * rows_per_frame + i / width.
struct VatLayout {
  int width = 0;
  int rows_per_frame = 0;
  int height = 0;  // frames * rows_per_frame
};

// The layout for frames of up to `num_items` items whose texture is the most nearly square.
//   what      for messages: "triangles"
//   max_size  the longest side that the texture may have
// Errors: kInvalidArgument if it would be longer; the message says what helps.
absl::StatusOr<VatLayout> FitVatLayout(int64_t num_frames, int64_t num_items,
                                       const std::string& what, int64_t max_size);

}  // namespace liquidblend::cli
