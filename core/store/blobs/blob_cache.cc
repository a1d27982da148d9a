#include "core/store/blobs/blob_cache.h"

#include <fcntl.h>
#include <sys/stat.h>

#include <algorithm>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "core/base/disk_space.h"
#include "core/base/log.h"
#include "core/base/status_macros.h"
#include "core/store/blobs/local_blob_store.h"

namespace liquidblend::store {
namespace {

// Files that were used more recently stay, since someone may be about to open them.
constexpr absl::Duration kUsedNow = absl::Minutes(1);

// What is removed beyond need when the disk is full, so that the cache is not listed at each write:
// this share of the cache, but not more than so many bytes.
constexpr int64_t kShareAhead = 16;
constexpr int64_t kMostAhead = int64_t{64} << 20;

absl::StatusOr<int64_t> FreeBytesOf(const std::string& directory) {
  LB_ASSIGN_OR_RETURN(const base::DiskSpace disk, base::ReadDiskSpace(directory));
  return disk.free_bytes;
}

int64_t SizeOf(const std::vector<BlobInfo>& infos) {
  int64_t num_bytes = 0;
  for (const BlobInfo& info : infos) num_bytes += info.size_bytes;
  return num_bytes;
}

// Removes the blobs that were used within the last minute from the list, and sorts the others by
// their last use.
void KeepIdle(std::vector<BlobInfo>& infos) {
  const absl::Time used_now = absl::Now() - kUsedNow;
  std::erase_if(infos, [&](const BlobInfo& info) { return info.modified > used_now; });
  std::ranges::stable_sort(infos, {}, &BlobInfo::modified);
}

}  // namespace

absl::StatusOr<std::unique_ptr<BlobCache>> BlobCache::Open(const std::string& directory,
                                                           int64_t max_bytes,
                                                           FreeBytes free_bytes) {
  if (free_bytes == nullptr) free_bytes = [directory] { return FreeBytesOf(directory); };
  std::unique_ptr<BlobCache> cache(new BlobCache(directory, max_bytes, std::move(free_bytes)));
  LB_ASSIGN_OR_RETURN(cache->blobs_,
                      OpenCacheBlobStore(directory, [cache = cache.get()](int64_t num_bytes) {
                        return cache->MakeRoomAfterRefusal(num_bytes);
                      }));
  return cache;
}

absl::StatusOr<std::shared_ptr<const Blob>> BlobCache::Find(const BlobId& id) {
  auto blob = blobs_->Open(id);
  if (blob.ok()) {
    // The time of modification is that of the last use. If it cannot be set, the cache only evicts
    // too early.
    utimensat(AT_FDCWD, LocalBlobPath(directory_, id).c_str(), nullptr, 0);
  } else if (absl::IsDataLoss(blob.status())) {
    base::LogWarning(absl::StrCat("cache: ", blob.status().message()));
    LB_RETURN_IF_ERROR(blobs_->Delete(id));
    return absl::NotFoundError(blob.status().message());
  }
  return blob;
}

absl::Status BlobCache::Trim() {
  LB_ASSIGN_OR_RETURN(std::vector<BlobInfo> infos, blobs_->List());
  int64_t num_bytes = SizeOf(infos);
  KeepIdle(infos);
  for (const BlobInfo& info : infos) {
    if (num_bytes <= max_bytes_) break;
    LB_RETURN_IF_ERROR(blobs_->Delete(info.id));
    num_bytes -= info.size_bytes;
  }
  return absl::OkStatus();
}

absl::Status BlobCache::MakeRoom(int64_t free_bytes) {
  LB_ASSIGN_OR_RETURN(int64_t num_free, free_bytes_());
  if (num_free >= free_bytes) return absl::OkStatus();
  LB_ASSIGN_OR_RETURN(std::vector<BlobInfo> infos, blobs_->List());
  KeepIdle(infos);
  if (num_free + SizeOf(infos) < free_bytes) return absl::OkStatus();
  for (const BlobInfo& info : infos) {
    if (num_free >= free_bytes) break;
    LB_RETURN_IF_ERROR(blobs_->Delete(info.id));
    LB_ASSIGN_OR_RETURN(num_free, free_bytes_());  // less than its size if it is open
  }
  return absl::OkStatus();
}

// What the disk calls free need not be free for this process, which may have a quota. So the sizes
// of the removed blobs count.
bool BlobCache::MakeRoomAfterRefusal(int64_t num_bytes) {
  absl::StatusOr<std::vector<BlobInfo>> infos = blobs_->List();
  const absl::StatusOr<int64_t> num_free = free_bytes_();
  if (!infos.ok() || !num_free.ok()) return false;
  KeepIdle(*infos);
  const int64_t idle_bytes = SizeOf(*infos);
  if (*num_free + idle_bytes < num_bytes) return false;
  const int64_t wanted = num_bytes + std::min(idle_bytes / kShareAhead, kMostAhead);
  int64_t num_removed = 0, removed_bytes = 0;
  for (const BlobInfo& info : *infos) {
    if (num_removed > 0 && removed_bytes >= wanted) break;
    if (!blobs_->Delete(info.id).ok()) break;
    ++num_removed;
    removed_bytes += info.size_bytes;
  }
  if (num_removed == 0) return false;
  base::LogInfo(absl::StrCat("cache: the disk of ", directory_, " is full; removed ", num_removed,
                             " copies of ", removed_bytes, " bytes"));
  return true;
}

}  // namespace liquidblend::store
