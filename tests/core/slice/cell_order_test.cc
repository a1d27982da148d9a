#include "core/slice/cell_order.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <vector>

#include "tests/synthetic/families.h"

namespace liquidblend::slice {
namespace {

TEST(HilbertPlace, GoesOnceThroughACubeInStepsOfOne) {
  constexpr uint32_t kSide = 16;  // the curve's beginning fills such cubes
  std::vector<std::array<uint32_t, 3>> points(kSide * kSide * kSide);
  std::vector<int> num_points(points.size());
  for (uint32_t x = 0; x < kSide; ++x) {
    for (uint32_t y = 0; y < kSide; ++y) {
      for (uint32_t z = 0; z < kSide; ++z) {
        const uint32_t place = HilbertPlace({x, y, z});
        ASSERT_LT(place, points.size());
        points[place] = {x, y, z};
        ++num_points[place];
      }
    }
  }
  EXPECT_EQ(std::count(num_points.begin(), num_points.end(), 1), std::ssize(points));
  for (size_t i = 1; i < points.size(); ++i) {
    int distance = 0;
    for (int k = 0; k < 3; ++k) {
      distance += std::abs(static_cast<int>(points[i][k]) - static_cast<int>(points[i - 1][k]));
    }
    EXPECT_EQ(distance, 1) << "at place " << i;
  }
}

TEST(HilbertPlace, IsAsLargeAsTheGrid) {
  uint32_t largest = 0;
  for (const uint32_t x : {0U, 1023U}) {
    for (const uint32_t y : {0U, 1023U}) {
      for (const uint32_t z : {0U, 1023U}) largest = std::max(largest, HilbertPlace({x, y, z}));
    }
  }
  EXPECT_EQ(largest, (1U << 30) - 1);  // the curve ends in a corner
}

TEST(OrderCells, HasEachCellOnceSlabAfterSlab) {
  const mesh::RegisteredFamily family = synthetic::MakeFamily(synthetic::MixedSphere(6), {});
  const std::vector<OrderedCell> ordered = OrderCells(family, family.wedges);
  ASSERT_GT(ordered.size(), 100U);
  std::vector<int> num_times(family.wedges.size());
  for (const OrderedCell& cell : ordered) ++num_times[cell.cell];
  EXPECT_EQ(std::count(num_times.begin(), num_times.end(), 1), std::ssize(family.wedges));
  const auto earliest = [&](const OrderedCell& cell) {
    float time = family.vertices[family.wedges[cell.cell][0]][3];
    for (const int32_t v : family.wedges[cell.cell]) time = std::min(time, family.vertices[v][3]);
    return time;
  };
  for (size_t i = 1; i < ordered.size(); ++i) {
    EXPECT_LE(ordered[i - 1].slab(), ordered[i].slab());
    if (ordered[i - 1].slab() < ordered[i].slab()) {
      EXPECT_LT(earliest(ordered[i - 1]), earliest(ordered[i]));
    }
  }
}

}  // namespace
}  // namespace liquidblend::slice
