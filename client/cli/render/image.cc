#include "client/cli/render/image.h"

#include <stb/stb_image_write.h>

#include "absl/strings/str_cat.h"

namespace liquidblend::render {

Image::Image(int image_width, int image_height, Color fill)
    : width(image_width), height(image_height) {
  rgb.reserve(3 * static_cast<size_t>(width) * static_cast<size_t>(height));
  for (int i = 0; i < width * height; ++i) rgb.insert(rgb.end(), {fill.r, fill.g, fill.b});
}

void Image::Set(int x, int y, Color color) {
  if (x < 0 || y < 0 || x >= width || y >= height) return;
  uint8_t* pixel = &rgb[3 * (static_cast<size_t>(y) * static_cast<size_t>(width) + x)];
  pixel[0] = color.r;
  pixel[1] = color.g;
  pixel[2] = color.b;
}

void Paste(const Image& source, int x, int y, Image* target) {
  for (int row = 0; row < source.height; ++row) {
    for (int column = 0; column < source.width; ++column) {
      const uint8_t* p =
          &source.rgb[3 * (static_cast<size_t>(row) * static_cast<size_t>(source.width) + column)];
      target->Set(x + column, y + row, {p[0], p[1], p[2]});
    }
  }
}

absl::StatusOr<std::string> ToPng(const Image& image) {
  if (int64_t{image.width} * image.height > kMaxPixels) {
    return absl::InvalidArgumentError(absl::StrCat("a picture of ", image.width, " x ",
                                                   image.height, " pixels has more than the ",
                                                   kMaxPixels, " that fit into a file"));
  }
  std::string png;
  const auto append = [](void* bytes, void* data, int size) {
    static_cast<std::string*>(bytes)->append(static_cast<const char*>(data),
                                             static_cast<size_t>(size));
  };
  if (stbi_write_png_to_func(append, &png, image.width, image.height, 3, image.rgb.data(),
                             3 * image.width) == 0) {
    return absl::InternalError(
        absl::StrCat("cannot make a PNG of ", image.width, " x ", image.height, " pixels"));
  }
  return png;
}

}  // namespace liquidblend::render
