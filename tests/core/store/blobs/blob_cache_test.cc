#include "core/store/blobs/blob_cache.h"

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "absl/time/clock.h"
#include "tests/core/store/store_testing.h"

namespace liquidblend::store {
namespace {

constexpr int64_t kBlobBytes = 100;

// A cache on a disk whose free space is what the test says, less what the blobs take.
class BlobCacheTest : public testing::Test {
 protected:
  void Open(int64_t max_bytes, int64_t disk_bytes) {
    auto cache = BlobCache::Open(folder_.path(), max_bytes, [this, disk_bytes] {
      return absl::StatusOr<int64_t>(disk_bytes - num_pinned_bytes_ - NumBytes());
    });
    ASSERT_THAT(cache, Succeeds());
    cache_ = *std::move(cache);
  }

  // Puts a blob there that was last used so many minutes ago.
  BlobId Put(char content, int minutes) {
    const std::string bytes(kBlobBytes, content);
    auto writer = cache_->Create();
    EXPECT_THAT(writer, Succeeds());
    EXPECT_THAT((*writer)->Append(std::as_bytes(std::span(bytes))), Succeeds());
    const auto id = (*writer)->Commit();
    EXPECT_THAT(id, Succeeds());
    std::filesystem::last_write_time(
        LocalBlobPath(folder_.path(), *id),
        std::filesystem::file_time_type::clock::now() - std::chrono::minutes(minutes));
    return *id;
  }

  bool Has(const BlobId& id) const {
    return std::filesystem::exists(LocalBlobPath(folder_.path(), id));
  }

  int64_t NumBytes() const {
    int64_t num_bytes = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_.path())) {
      if (entry.is_regular_file()) num_bytes += static_cast<int64_t>(entry.file_size());
    }
    return num_bytes;
  }

  const TemporaryFolder folder_;
  int64_t num_pinned_bytes_ = 0;  // of others
  std::unique_ptr<BlobCache> cache_;
};

TEST_F(BlobCacheTest, TrimRemovesTheLeastRecentlyUsedBeyondTheBudget) {
  Open(2 * kBlobBytes, 1 << 20);
  const BlobId middle = Put('m', 20), old = Put('o', 30), young = Put('y', 10);
  EXPECT_THAT(cache_->Trim(), Succeeds());
  EXPECT_FALSE(Has(old));
  EXPECT_TRUE(Has(middle));
  EXPECT_TRUE(Has(young));
}

TEST_F(BlobCacheTest, WhatWasUsedWithinTheLastMinuteStays) {
  Open(0, 1 << 20);
  const BlobId now = Put('n', 0), old = Put('o', 30);
  EXPECT_THAT(cache_->Trim(), Succeeds());
  EXPECT_TRUE(Has(now));
  EXPECT_FALSE(Has(old));
}

TEST_F(BlobCacheTest, MakesRoomOnADiskThatIsSmallerThanItsBudget) {
  Open(100 * kBlobBytes, 3 * kBlobBytes);
  const BlobId old = Put('o', 30), middle = Put('m', 20), young = Put('y', 10);
  EXPECT_THAT(cache_->Trim(), Succeeds());
  EXPECT_TRUE(Has(old)) << "the budget is far away";
  EXPECT_THAT(cache_->MakeRoom(kBlobBytes + 1), Succeeds());
  EXPECT_FALSE(Has(old));
  EXPECT_FALSE(Has(middle));
  EXPECT_TRUE(Has(young));
}

TEST_F(BlobCacheTest, RemovesNothingInVain) {
  Open(100 * kBlobBytes, 3 * kBlobBytes);
  num_pinned_bytes_ = kBlobBytes;
  const BlobId old = Put('o', 30), now = Put('n', 0);
  EXPECT_THAT(cache_->MakeRoom(2 * kBlobBytes), Succeeds());
  EXPECT_TRUE(Has(old));
  EXPECT_TRUE(Has(now));
  EXPECT_THAT(cache_->MakeRoom(kBlobBytes), Succeeds());
  EXPECT_FALSE(Has(old));
}

}  // namespace
}  // namespace liquidblend::store
