// The cache of a store in S3 on a disk that is smaller than the cache may be. The disk is played by
// write() and statvfs() of this program.
#include <dlfcn.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <climits>
#include <filesystem>
#include <string>
#include <string_view>

#include "core/base/disk_space.h"
#include "core/store/blobs/s3_blob_store.h"
#include "tests/core/store/blobs/fake_s3.h"
#include "tests/core/store/store_testing.h"

namespace liquidblend::store {
namespace {

namespace fs = std::filesystem;

// The disk under test; its file system has blocks of one byte.
struct SmallDisk {
  std::string folder;  // empty: there is none
  int64_t size_bytes = 0;
  bool shows_free_bytes = true;  // to statvfs(), which knows nothing of a user's quota
  int error = ENOSPC;
  int num_refused = 0;
};
SmallDisk disk;

int64_t UsedBytes() {
  int64_t num_bytes = 0;
  for (const auto& entry : fs::recursive_directory_iterator(disk.folder)) {
    if (entry.is_regular_file()) num_bytes += static_cast<int64_t>(entry.file_size());
  }
  return num_bytes;
}

bool IsOnDisk(std::string_view path) {
  return !disk.folder.empty() && path.starts_with(disk.folder);
}

bool IsOnDisk(int fd) {
  if (disk.folder.empty()) return false;
  std::array<char, PATH_MAX> path;
  const std::string link = "/proc/self/fd/" + std::to_string(fd);
  const ssize_t size = readlink(link.c_str(), path.data(), path.size());
  return size > 0 && IsOnDisk(std::string_view(path.data(), static_cast<size_t>(size)));
}

template <typename Function>
Function* Next(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

int Ask(const char* name, const char* path, struct statvfs* answer) {
  const int result = Next<int(const char*, struct statvfs*)>(name)(path, answer);
  if (result != 0 || !IsOnDisk(path) || !disk.shows_free_bytes) return result;
  answer->f_frsize = answer->f_bsize = 1;
  answer->f_blocks = static_cast<fsblkcnt_t>(disk.size_bytes);
  answer->f_bavail = answer->f_bfree = static_cast<fsblkcnt_t>(disk.size_bytes - UsedBytes());
  return 0;
}

}  // namespace

extern "C" {

ssize_t write(int fd, const void* bytes, size_t size) {
  static auto* const next = Next<ssize_t(int, const void*, size_t)>("write");
  if (!IsOnDisk(fd)) return next(fd, bytes, size);
  const int64_t num_free = disk.size_bytes - UsedBytes();
  if (num_free > 0) return next(fd, bytes, std::min(size, static_cast<size_t>(num_free)));
  ++disk.num_refused;
  errno = disk.error;
  return -1;
}

int statvfs(const char* path, struct statvfs* answer) noexcept {
  return Ask("statvfs", path, answer);
}
int statvfs64(const char* path, struct statvfs64* answer) noexcept {
  return Ask("statvfs64", path, reinterpret_cast<struct statvfs*>(answer));
}

}  // extern "C"

namespace {

constexpr size_t kBlobBytes = 1000;

class FullDiskTest : public testing::Test {
 protected:
  FullDiskTest() {
    S3Options options;
    options.endpoint = s3_.endpoint();
    options.access_key_id = "key";
    options.secret_access_key = "secret";
    options.first_pause = absl::Milliseconds(1);
    options.longest_pause = absl::Milliseconds(4);
    options.cache_directory = folder_.path() + "/elsewhere";
    elsewhere_ = *OpenS3BlobStore("s3://bucket/x", options);
    options.cache_directory = folder_.path() + "/cache";
    blobs_ = *OpenS3BlobStore("s3://bucket/x", options);
    disk = {.folder = options.cache_directory, .size_bytes = 3500};
  }
  ~FullDiskTest() override { disk = {}; }

  static std::string Content(uint32_t seed) { return SampleBytes(kBlobBytes, seed); }

  // Three copies in the cache, the first one the least recently used, hours ago.
  void FillCache() {
    for (uint32_t k = 0; k < 3; ++k) {
      const auto id = PutBlob(*blobs_, AsBytes(Content(k)));
      ASSERT_THAT(id, Succeeds());
      cached_.push_back(*id);
      Age(*id, std::chrono::hours(10 - k));
    }
  }

  static void Age(const BlobId& id, std::chrono::minutes age) {
    fs::last_write_time(LocalBlobPath(disk.folder, id), fs::file_time_type::clock::now() - age);
  }

  static bool IsCached(const BlobId& id) { return fs::exists(LocalBlobPath(disk.folder, id)); }

  FakeS3 s3_;
  TemporaryFolder folder_;
  std::unique_ptr<BlobStore> elsewhere_, blobs_;
  std::vector<BlobId> cached_;
};

TEST_F(FullDiskTest, ABlobIsFetchedInPlaceOfTheLeastRecentlyUsed) {
  FillCache();
  const auto id = PutBlob(*elsewhere_, AsBytes(Content(7)));
  ASSERT_THAT(id, Succeeds());
  const auto blob = blobs_->Open(*id);
  ASSERT_THAT(blob, Succeeds());
  EXPECT_EQ(AsString((*blob)->bytes()), Content(7));
  EXPECT_EQ(disk.num_refused, 0) << "its size is known before";
  EXPECT_FALSE(IsCached(cached_[0]));
  EXPECT_TRUE(IsCached(cached_[1]));
  EXPECT_TRUE(IsCached(cached_[2]));
}

TEST_F(FullDiskTest, ABlobIsFetchedThoughTheDiskClaimsToHaveRoom) {
  FillCache();
  disk.shows_free_bytes = false;
  const auto id = PutBlob(*elsewhere_, AsBytes(Content(7)));
  ASSERT_THAT(id, Succeeds());
  EXPECT_THAT(blobs_->Open(*id), Succeeds());
  EXPECT_GT(disk.num_refused, 0);
  EXPECT_FALSE(IsCached(cached_[0]));
  EXPECT_TRUE(IsCached(cached_[2]));
}

TEST_F(FullDiskTest, ABlobIsWrittenInPlaceOfTheLeastRecentlyUsed) {
  FillCache();
  const auto writer = blobs_->Create();
  ASSERT_THAT(writer, Succeeds());
  std::string content;
  for (uint32_t k = 0; k < 5; ++k) {  // the first one fits, a part of the second does
    const std::string part = SampleBytes(300, k);
    ASSERT_THAT((*writer)->Append(AsBytes(part)), Succeeds()) << k;
    content += part;
  }
  const auto id = (*writer)->Commit();
  ASSERT_THAT(id, Succeeds());
  EXPECT_GT(disk.num_refused, 0);
  EXPECT_EQ(s3_.Objects().at("x/" + BlobKey(*id)), content);
  EXPECT_FALSE(IsCached(cached_[0]));
  EXPECT_TRUE(IsCached(cached_[2]));
}

TEST_F(FullDiskTest, WhatIsInUseStaysAndTheDiskIsNamed) {
  FillCache();
  for (const BlobId& id : cached_) Age(id, std::chrono::minutes(0));
  EXPECT_THAT(PutBlob(*blobs_, AsBytes(Content(7))),
              Fails(absl::StatusCode::kResourceExhausted, disk.folder));
  for (const BlobId& id : cached_) EXPECT_TRUE(IsCached(id));
  Age(cached_[1], std::chrono::minutes(2));
  EXPECT_THAT(PutBlob(*blobs_, AsBytes(Content(7))), Succeeds());
  EXPECT_FALSE(IsCached(cached_[1]));
}

TEST_F(FullDiskTest, NothingIsRemovedInVain) {
  FillCache();
  const std::string large = SampleBytes(4000);
  EXPECT_THAT(PutBlob(*blobs_, AsBytes(large)),
              Fails(absl::StatusCode::kResourceExhausted, disk.folder));
  for (const BlobId& id : cached_) EXPECT_TRUE(IsCached(id));
}

// A lack of descriptors or memory, or a limit of a file's size, would empty the cache for nothing.
TEST_F(FullDiskTest, NothingIsRemovedForOtherLimits) {
  FillCache();
  for (const int error : {EFBIG, ENOMEM}) {
    disk.error = error;
    EXPECT_THAT(PutBlob(*blobs_, AsBytes(Content(7))),
                Fails(absl::StatusCode::kResourceExhausted, disk.folder));
  }
  EXPECT_GT(disk.num_refused, 0);
  for (const BlobId& id : cached_) EXPECT_TRUE(IsCached(id));
}

}  // namespace
}  // namespace liquidblend::store
