#include "client/cli/render/sheet.h"

#include <gtest/gtest.h>
#include <stb/stb_image.h>

namespace liquidblend::render {
namespace {

constexpr Color kRed{200, 10, 10};
constexpr Color kGreen{10, 200, 10};

int Count(const Image& image, Color color) {
  int count = 0;
  for (size_t i = 0; i < image.rgb.size(); i += 3) {
    count += image.rgb[i] == color.r && image.rgb[i + 1] == color.g && image.rgb[i + 2] == color.b;
  }
  return count;
}

Image ComposeOk(const Sheet& sheet) {
  const absl::StatusOr<Image> image = Compose(sheet);
  EXPECT_TRUE(image.ok()) << image.status();
  return image.ok() ? *image : Image();
}

TEST(Sheet, ShowsEveryPictureWholeAlsoInAShorterRow) {
  Sheet sheet;
  sheet.rows = {{Image(20, 10, kRed), Image(20, 10, kRed), Image(20, 10, kRed)},
                {Image(20, 10, kGreen)}};
  const Image image = ComposeOk(sheet);
  EXPECT_EQ(Count(image, kRed), 3 * 200);
  EXPECT_EQ(Count(image, kGreen), 200);
}

TEST(Sheet, MakesRoomForLabelsAndDrawsThem) {
  Sheet sheet;
  sheet.rows = {{Image(40, 30, kRed)}};
  const Image bare = ComposeOk(sheet);
  sheet.row_labels = {"weight 0.5\ndrops"};
  sheet.column_labels = {"1 s"};
  const Image labelled = ComposeOk(sheet);
  EXPECT_GE(labelled.width, bare.width + TextWidth("weight 0.5", 1));
  EXPECT_GE(labelled.height, bare.height + kTextHeight);
  EXPECT_EQ(Count(labelled, kRed), 40 * 30) << "labels do not cover pictures";
  constexpr Color kPaper{255, 255, 255};
  EXPECT_LT(Count(labelled, kPaper), labelled.width * labelled.height - 40 * 30 - 50);
}

TEST(Sheet, RefusesMorePixelsThanAPictureHolds) {
  Sheet sheet;
  sheet.rows.assign(15000, {Image(1, 10, kRed)});
  sheet.row_labels = {std::string(80'000, 'x')};  // drawn cut
  EXPECT_TRUE(absl::IsInvalidArgument(Compose(sheet).status()));
  // More than 2^32 in height, and in all.
  sheet = {};
  sheet.rows.assign(1, {Image(1, 1, kRed)});
  sheet.rows[0][0].height = 2'000'000'000;
  sheet.rows.resize(3);
  EXPECT_TRUE(absl::IsInvalidArgument(Compose(sheet).status()));
  EXPECT_TRUE(absl::IsInvalidArgument(ToPng(sheet.rows[0][0]).status()));
}

// Each letter outside of the font is as wide as its substitute, and drawn as it.
TEST(Image, TextThatTheFontHasNotIsDrawnAsQuestionMarks) {
  const std::string strange = "a\xC3\xA4\x80\xFF\x01\x7F\x1B\r\t";
  const std::string plain = "a?????????";
  ASSERT_EQ(strange.size(), plain.size());
  EXPECT_EQ(TextWidth(strange, 1), TextWidth(plain, 1));
  Image image(200, 20, kRed), expected(200, 20, kRed);
  DrawText(strange, 0, 0, 1, kGreen, &image);
  DrawText(plain, 0, 0, 1, kGreen, &expected);
  EXPECT_EQ(image.rgb, expected.rgb);
}

TEST(Image, TextStaysInsideItsLine) {
  Image image(200, 40, kRed);
  DrawText("weight -0.25", 5, 8, 2, kGreen, &image);
  EXPECT_GT(Count(image, kGreen), 100);
  for (int x = 0; x < image.width; ++x) {
    for (const int y : {0, 7, 8 + 2 * kTextHeight, 39}) {
      EXPECT_EQ(image.rgb[3 * static_cast<size_t>(y * image.width + x)], kRed.r) << x << " " << y;
    }
  }
  DrawText("cut off at every edge", -9, -4, 3, kGreen, &image);
}

TEST(Image, PngGivesBackThePixels) {
  Image image(17, 9, kRed);
  image.Set(3, 4, kGreen);
  const auto png = ToPng(image);
  ASSERT_TRUE(png.ok());
  int width = 0;
  int height = 0;
  int channels = 0;
  unsigned char* pixels =
      stbi_load_from_memory(reinterpret_cast<const unsigned char*>(png->data()),
                            static_cast<int>(png->size()), &width, &height, &channels, 3);
  ASSERT_NE(pixels, nullptr);
  EXPECT_EQ(width, 17);
  EXPECT_EQ(height, 9);
  EXPECT_EQ(std::vector<uint8_t>(pixels, pixels + image.rgb.size()), image.rgb);
  stbi_image_free(pixels);
}

}  // namespace
}  // namespace liquidblend::render
