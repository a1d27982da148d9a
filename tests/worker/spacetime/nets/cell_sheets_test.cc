#include "worker/spacetime/nets/cell_sheets.h"

#include <gtest/gtest.h>

#include <bit>

namespace liquidblend::spacetime {
namespace {

TEST(FindSheets, NoneWhereAllCornersAgree) {
  EXPECT_EQ(FindSheets(0).count, 0);
  EXPECT_EQ(FindSheets(0xFFFF).count, 0);
}

TEST(FindSheets, OneAroundACornerWithItsFourEdges) {
  for (int corner = 0; corner < 16; ++corner) {
    const CellSheets sheets = FindSheets(static_cast<uint16_t>(1 << corner));
    ASSERT_EQ(sheets.count, 1) << corner;
    EXPECT_EQ(std::popcount(sheets.edges[0]), 4);
  }
}

TEST(FindSheets, KeepsLiquidAtOppositeCornersApart) {
  EXPECT_EQ(FindSheets(1 << 0 | 1 << 15).count, 2);
  EXPECT_EQ(FindSheets(1 << 0 | 1 << 3).count, 2);  // across a face
  EXPECT_EQ(FindSheets(1 << 0 | 1 << 1).count, 1);  // along an edge
}

TEST(FindSheets, JoinsAirAcrossAFace) {
  EXPECT_EQ(FindSheets(static_cast<uint16_t>(~(1 << 0 | 1 << 3))).count, 1);
}

TEST(FindSheets, EveryCrossedEdgeHasOneSheet) {
  for (int bits = 0; bits < 1 << 16; ++bits) {
    const CellSheets sheets = FindSheets(static_cast<uint16_t>(bits));
    EXPECT_EQ(NumSheets(static_cast<uint16_t>(bits)), sheets.count);
    uint32_t all = 0;
    for (int n = 0; n < sheets.count; ++n) {
      ASSERT_EQ(all & sheets.edges[n], 0u) << bits;
      all |= sheets.edges[n];
    }
    for (int axis = 0; axis < 4; ++axis) {
      for (int lower = 0; lower < 16; ++lower) {
        if ((lower >> axis & 1) != 0) continue;
        const int edge = CellEdge(axis, lower);
        const bool crossed = ((bits >> lower ^ bits >> (lower | 1 << axis)) & 1) != 0;
        ASSERT_EQ((all >> edge & 1) != 0, crossed) << bits;
        if (!crossed) continue;
        ASSERT_NE(sheets.edges[sheets.sheet_of[edge]] >> edge & 1, 0u) << bits;
      }
    }
  }
}

}  // namespace
}  // namespace liquidblend::spacetime
