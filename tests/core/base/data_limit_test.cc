#include "core/base/data_limit.h"

#include <gtest/gtest.h>
#include <sys/mman.h>

#include <limits>
#include <new>
#include <thread>
#include <vector>

#include "tests/allocation_testing.h"

namespace liquidblend::base {
namespace {

constexpr int64_t kMebibyte = 1 << 20;

bool CanAllocate(int64_t bytes) {
  try {
    const std::vector<char> memory(static_cast<size_t>(bytes));
    return memory.size() == static_cast<size_t>(bytes);
  } catch (const std::bad_alloc&) {
    return false;
  }
}

TEST(ScopedDataLimit, RefusesWhatGoesBeyondUntilItEnds) {
  LB_SKIP_UNLESS_ALLOCATIONS_MAY_FAIL();
  {
    const ScopedDataLimit limit(256 * kMebibyte);
    ASSERT_TRUE(limit.is_set());
    EXPECT_TRUE(CanAllocate(128 * kMebibyte));
    EXPECT_FALSE(CanAllocate(512 * kMebibyte));
    EXPECT_FALSE(limit.IsNearlyReached());
  }
  EXPECT_TRUE(CanAllocate(512 * kMebibyte));
}

TEST(ScopedDataLimit, CountsManySmallBlocks) {
  LB_SKIP_UNLESS_ALLOCATIONS_MAY_FAIL();
  const ScopedDataLimit limit(64 * kMebibyte);
  std::vector<std::vector<char>> blocks;
  bool is_nearly_reached = false;
  int64_t bytes = 0;
  try {
    for (; bytes < 128 * kMebibyte; bytes += 10'000) blocks.emplace_back(10'000);
  } catch (const std::bad_alloc&) {
    is_nearly_reached = limit.IsNearlyReached();
  }
  EXPECT_LT(bytes, 65 * kMebibyte);
  EXPECT_TRUE(is_nearly_reached);
}

TEST(ScopedDataLimit, HoldsForOtherThreads) {
  LB_SKIP_UNLESS_ALLOCATIONS_MAY_FAIL();
  const ScopedDataLimit limit(256 * kMebibyte);
  bool can_allocate = true;
  std::thread([&] { can_allocate = CanAllocate(512 * kMebibyte); }).join();
  EXPECT_FALSE(can_allocate);
}

TEST(ScopedDataLimit, LetsMappedFilesAndReservedAddressesPass) {
  const ScopedDataLimit limit(64 * kMebibyte);
  for (const int protection : {PROT_NONE, PROT_READ}) {
    void* const memory =
        mmap(nullptr, 1 << 30, protection, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    ASSERT_NE(memory, MAP_FAILED);
    munmap(memory, 1 << 30);
  }
}

TEST(ScopedDataLimit, AHugeOneIsNone) {
  const ScopedDataLimit limit(std::numeric_limits<int64_t>::max());
  EXPECT_TRUE(limit.is_set());
  EXPECT_TRUE(CanAllocate(128 * kMebibyte));
  EXPECT_FALSE(limit.IsNearlyReached());
}

TEST(DataBytesLeft, IsWhatTheLimitLeavesAndTheMachineHas) {
  LB_SKIP_UNLESS_ALLOCATIONS_MAY_FAIL();
  const int64_t without = DataBytesLeft();
  EXPECT_GT(without, 256 * kMebibyte);
  const ScopedDataLimit limit(256 * kMebibyte);
  EXPECT_LE(DataBytesLeft(), 256 * kMebibyte);
  EXPECT_GT(DataBytesLeft(), 250 * kMebibyte);
  const std::vector<char> memory(100 * kMebibyte);
  EXPECT_LT(DataBytesLeft(), 157 * kMebibyte);
}

TEST(MemoryLimitError, IsToldFromAFullDisk) {
  EXPECT_TRUE(absl::IsResourceExhausted(MemoryLimitError("too much")));
  EXPECT_TRUE(IsOverMemoryLimit(MemoryLimitError("too much")));
  EXPECT_FALSE(IsOverMemoryLimit(absl::ResourceExhaustedError("disk full")));
  EXPECT_FALSE(IsOverMemoryLimit(absl::OkStatus()));
}

}  // namespace
}  // namespace liquidblend::base
