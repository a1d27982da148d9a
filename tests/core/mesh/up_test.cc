#include "core/mesh/up.h"

#include <gtest/gtest.h>

namespace liquidblend::mesh {
namespace {

TEST(Up, NamesGoBothWays) {
  for (int n = 1; n <= 6; ++n) {
    const Up up = static_cast<Up>(n);
    EXPECT_EQ(UpOfName(NameOf(up)), up) << NameOf(up);
  }
  EXPECT_EQ(NameOf(Up::kMinusY), "-y");
  for (const char* name : {"", "unknown", "Y", "+y", "w", "--y"}) {
    EXPECT_FALSE(UpOfName(name).has_value()) << name;
  }
}

TEST(Up, IsAnAxisAndASignAndZUnlessItIsKnown) {
  EXPECT_EQ(AxisOf(Up::kX), (HeightAxis{0, 1}));
  EXPECT_EQ(AxisOf(Up::kMinusY), (HeightAxis{1, -1}));
  EXPECT_EQ(AxisOf(Up::kMinusZ), (HeightAxis{2, -1}));
  EXPECT_EQ(AxisOf(Up::kUnknown), AxisOf(Up::kZ));
  EXPECT_EQ(DescribeUp(Up::kY), "y");
  EXPECT_EQ(DescribeUp(Up::kUnknown), "z (assumed)");
}

}  // namespace
}  // namespace liquidblend::mesh
