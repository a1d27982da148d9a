// Letters as the small boxes that stb_easy_font makes of them.
#include <stb/stb_easy_font.h>

#include <cstddef>

#include "client/cli/render/image.h"

namespace liquidblend::render {
namespace {

constexpr size_t kBytesPerLetter = 300;  // stb_easy_font.h: 270 on average

// Bytes of a text that are drawn: widths and sizes of buffers stay far below those of an int.
constexpr size_t kMaxBytes = 10000;

// The library has 95 letters and looks others up outside of its table.
std::string Drawable(const std::string& text) {
  std::string drawable = text.substr(0, kMaxBytes);
  for (char& c : drawable) {
    if (c != '\n' && (c < ' ' || c > '~')) c = '?';
  }
  return drawable;
}

struct BoxCorner {
  float x;
  float y;
  float z;
  unsigned char color[4];
};

void FillBox(int left, int top, int right, int bottom, Color color, Image* image) {
  for (int y = top; y < bottom; ++y) {
    for (int x = left; x < right; ++x) image->Set(x, y, color);
  }
}

}  // namespace

void DrawText(const std::string& text, int x, int y, int scale, Color color, Image* image) {
  std::string line = Drawable(text);  // the library takes a char*, though it does not write
  std::vector<BoxCorner> corners((line.size() + 1) * kBytesPerLetter / sizeof(BoxCorner));
  const int num_boxes = stb_easy_font_print(0.0f, 0.0f, line.data(), nullptr, corners.data(),
                                            static_cast<int>(corners.size() * sizeof(BoxCorner)));
  for (int box = 0; box < num_boxes; ++box) {
    const BoxCorner& low = corners[4 * static_cast<size_t>(box)];
    const BoxCorner& high = corners[4 * static_cast<size_t>(box) + 2];
    FillBox(x + scale * static_cast<int>(low.x), y + scale * static_cast<int>(low.y),
            x + scale * static_cast<int>(high.x), y + scale * static_cast<int>(high.y), color,
            image);
  }
}

int TextWidth(const std::string& text, int scale) {
  std::string line = Drawable(text);
  return scale * stb_easy_font_width(line.data());
}

}  // namespace liquidblend::render
