#include "client/cli/export/vat_layout.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace liquidblend::cli {
namespace {

using ::testing::HasSubstr;

TEST(FitVatLayout, HasRoomForAllItemsAndIsNearlySquare) {
  for (const int64_t frames : {1, 72, 500}) {
    for (const int64_t items : {0, 1, 7, 11456, 100000}) {
      const auto layout = FitVatLayout(frames, items, "triangles", 8192);
      ASSERT_TRUE(layout.ok()) << layout.status();
      EXPECT_GE(int64_t{layout->width} * layout->rows_per_frame, items);
      EXPECT_EQ(layout->height, frames * layout->rows_per_frame);
      EXPECT_LE(layout->width, 8192);
      EXPECT_LE(layout->height, 8192);
    }
  }
  const auto layout = FitVatLayout(72, 11456, "triangles", 8192);
  EXPECT_EQ(layout->width, 882);
  EXPECT_EQ(layout->height, 936);
}

TEST(FitVatLayout, RefusesWhatIsTooLargeAndSaysWhatHelps) {
  const auto layout = FitVatLayout(300, 1000000, "triangles", 8192);
  EXPECT_EQ(layout.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(layout.status().message()),
              HasSubstr("300 frames of up to 1000000 triangles do not fit into a texture of 8192 x "
                        "8192; use a coarser level (--lod), fewer frames (--fps), or "
                        "--texture-size"));
  EXPECT_TRUE(FitVatLayout(8192, 8192, "vertices", 8192).ok());
  EXPECT_FALSE(FitVatLayout(8193, 1, "vertices", 8192).ok());
  EXPECT_FALSE(FitVatLayout(8192, 8193, "vertices", 8192).ok());
}

}  // namespace
}  // namespace liquidblend::cli
