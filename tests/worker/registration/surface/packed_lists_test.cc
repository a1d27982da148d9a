#include "worker/registration/surface/packed_lists.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace liquidblend::registration {
namespace {

using Lists = std::vector<std::vector<int32_t>>;

constexpr int32_t kMost = std::numeric_limits<int32_t>::max();

PackedLists Pack(const Lists& lists, int num_threads = 2) {
  return PackedLists(static_cast<int64_t>(lists.size()), parallel::Arena(num_threads),
                     [&](int64_t row, std::vector<int32_t>& list) { list = lists[row]; });
}

Lists Unpack(const PackedLists& packed) {
  Lists lists;
  for (int64_t row = 0; row < packed.num_rows(); ++row) {
    lists.emplace_back(packed[row].begin(), packed[row].end());
    EXPECT_EQ(packed[row].size(), lists.back().size());
    EXPECT_EQ(packed[row].empty(), lists.back().empty());
  }
  return lists;
}

// Of up to `most` ascending indices, with distances of up to a million.
Lists RandomLists(size_t count, uint32_t most) {
  std::mt19937 random(1);
  Lists lists(count);
  for (std::vector<int32_t>& list : lists) {
    const uint32_t size = static_cast<uint32_t>(random()) % (most + 1);
    for (int64_t at = -1; list.size() < size; list.push_back(static_cast<int32_t>(at))) {
      at += 1 + (static_cast<int64_t>(random()) >> (12 + random() % 20));
    }
  }
  return lists;
}

TEST(PackedLists, HoldWhatTheyAreFilledWith) {
  const Lists lists = {{},
                       {0},
                       {kMost},
                       {0, 1, 2, 3, 4},
                       {0, 256, 257, 513, 65'793, 131'330, kMost},
                       {0, 257, 514, 771, 1 << 20}};
  EXPECT_EQ(Unpack(Pack(lists)), lists);
  EXPECT_EQ(Unpack(PackedLists()), Lists());
}

TEST(PackedLists, HoldMoreRowsThanAChunkAndLongOnes) {
  const Lists many = RandomLists(10'000, 30), longer = RandomLists(20, 600);
  EXPECT_EQ(Unpack(Pack(many)), many);
  EXPECT_EQ(Unpack(Pack(longer)), longer);
  for (const size_t size : {32, 64, 254, 255, 256}) {
    const Lists one = {std::vector<int32_t>(size, 7)};
    EXPECT_EQ(Unpack(Pack(one)), one);
  }
}

TEST(PackedLists, HoldListsThatDoNotAscend) {
  const Lists lists = {{5, 5, 5}, {9, 3, 3, kMost, 0}};
  EXPECT_EQ(Unpack(Pack(lists)), lists);
}

TEST(PackedLists, AreTheSameAtAnyThreadCount) {
  const Lists lists = RandomLists(20'000, 30);
  EXPECT_TRUE(Pack(lists, 1) == Pack(lists, 8));
  EXPECT_FALSE(Pack(lists) == Pack({{1}}));
}

// Neighbours in a mesh: three runs of three in each of three layers.
TEST(PackedLists, TakeAThirdOfWhatNumbersWould) {
  Lists lists;
  size_t num_indices = 0;
  for (int32_t v = 100'000; v < 120'000; ++v) {
    lists.emplace_back();
    for (const int32_t layer : {-80'000, 0, 80'000}) {
      for (const int32_t run : {-150, 0, 150}) {
        for (const int32_t step : {-1, 0, 1}) lists.back().push_back(v + layer + run + step);
      }
    }
    num_indices += lists.back().size();
  }
  EXPECT_LT(Pack(lists).num_bytes(), num_indices * sizeof(int32_t) / 3);
}

}  // namespace
}  // namespace liquidblend::registration
