// Pictures: 8 bits per channel, red, green, blue, from the top left, row by row.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace liquidblend::render {

struct Color {
  uint8_t r = 0;
  uint8_t g = 0;
  uint8_t b = 0;
};

struct Image {
  Image() = default;
  Image(int image_width, int image_height, Color fill);

  void Set(int x, int y, Color color);  // nothing outside the picture

  int width = 0;
  int height = 0;
  std::vector<uint8_t> rgb;  // 3 x width x height
};

// Copies `source` with its top left at (x, y), cut at the edges.
void Paste(const Image& source, int x, int y, Image* target);

// Draws ASCII text with its top left at (x, y); a line is 12 x scale pixels high. Other bytes are
// drawn as '?', and those after the first 10,000 are not.
void DrawText(const std::string& text, int x, int y, int scale, Color color, Image* image);

// Width in pixels of what DrawText draws.
int TextWidth(const std::string& text, int scale);

inline constexpr int kTextHeight = 12;  // times scale; descenders included

// A PNG of more may overflow sizes in the library, which are of int: its buffer doubles as it
// grows.
inline constexpr int64_t kMaxPixels = int64_t{1} << 27;

// Bytes of a PNG file.  Errors: kInternal, kInvalidArgument (more than kMaxPixels).
absl::StatusOr<std::string> ToPng(const Image& image);

}  // namespace liquidblend::render
