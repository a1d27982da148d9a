#include "client/cli/render/sheet.h"

#include <algorithm>
#include <cstdint>

#include "absl/strings/str_cat.h"
#include "client/src/status_macros.h"

namespace liquidblend::render {
namespace {

constexpr Color kPaper{255, 255, 255};
constexpr Color kInk{52, 64, 78};
constexpr int kGap = 4;      // between pictures
constexpr int kPadding = 8;  // around labels

struct Layout {
  int tile_width = 0;
  int tile_height = 0;
  int num_columns = 0;
  int num_rows = 0;
  int text_scale = 1;
  int left = 0;  // of the first picture
  int top = 0;

  // Requires of X() and Y(): CheckSize().
  int X(int column) const { return left + column * (tile_width + kGap); }
  int Y(int row) const { return top + row * (tile_height + kGap); }
};

absl::Status CheckSize(const Layout& layout) {
  const int64_t width = layout.left + int64_t{layout.num_columns} * (layout.tile_width + kGap);
  const int64_t height = layout.top + int64_t{layout.num_rows} * (layout.tile_height + kGap);
  if (width <= kMaxPixels && height <= kMaxPixels / width) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("a sheet of ", width, " x ", height,
                                                 " pixels has more than ", kMaxPixels,
                                                 "; choose smaller pictures (--size) or fewer"));
}

int NumLines(const std::string& text) {
  return 1 + static_cast<int>(std::count(text.begin(), text.end(), '\n'));
}

int TextHeight(const std::string& text, int scale) { return scale * kTextHeight * NumLines(text); }

Layout MakeLayout(const Sheet& sheet) {
  Layout layout;
  layout.num_rows = static_cast<int>(sheet.rows.size());
  for (const std::vector<Image>& row : sheet.rows) {
    layout.num_columns = std::max(layout.num_columns, static_cast<int>(row.size()));
    for (const Image& tile : row) {
      layout.tile_width = tile.width;
      layout.tile_height = tile.height;
    }
  }
  layout.text_scale = layout.tile_width >= 240 ? 2 : 1;
  layout.left = kGap;
  layout.top = kGap;
  for (const std::string& label : sheet.row_labels) {
    layout.left = std::max(layout.left, TextWidth(label, layout.text_scale) + 2 * kPadding);
  }
  for (const std::string& label : sheet.column_labels) {
    layout.top = std::max(layout.top, TextHeight(label, layout.text_scale) + kPadding);
  }
  return layout;
}

void DrawLabels(const Sheet& sheet, const Layout& layout, Image* image) {
  const int scale = layout.text_scale;
  for (int row = 0; row < static_cast<int>(sheet.row_labels.size()); ++row) {
    const std::string& label = sheet.row_labels[static_cast<size_t>(row)];
    const int middle = layout.Y(row) + layout.tile_height / 2;
    DrawText(label, kPadding, middle - TextHeight(label, scale) / 2, scale, kInk, image);
  }
  for (int column = 0; column < static_cast<int>(sheet.column_labels.size()); ++column) {
    const std::string& label = sheet.column_labels[static_cast<size_t>(column)];
    const int middle = layout.X(column) + layout.tile_width / 2;
    DrawText(label, middle - TextWidth(label, scale) / 2, kPadding, scale, kInk, image);
  }
}

}  // namespace

absl::StatusOr<Image> Compose(const Sheet& sheet) {
  const Layout layout = MakeLayout(sheet);
  LBC_RETURN_IF_ERROR(CheckSize(layout));
  Image image(layout.X(layout.num_columns), layout.Y(layout.num_rows), kPaper);
  for (int row = 0; row < layout.num_rows; ++row) {
    const std::vector<Image>& tiles = sheet.rows[static_cast<size_t>(row)];
    for (int column = 0; column < static_cast<int>(tiles.size()); ++column) {
      Paste(tiles[static_cast<size_t>(column)], layout.X(column), layout.Y(row), &image);
    }
  }
  DrawLabels(sheet, layout, &image);
  return image;
}

}  // namespace liquidblend::render
