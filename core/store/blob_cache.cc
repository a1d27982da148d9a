#include "core/store/blob_cache.h"

#include <fcntl.h>
#include <sys/stat.h>

#include <algorithm>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "core/base/log.h"
#include "core/base/status_macros.h"

namespace liquidblend::store {
namespace {

// Someone may be about to open what was put here so recently.
constexpr absl::Duration kUsedNow = absl::Minutes(1);

}  // namespace

absl::StatusOr<std::unique_ptr<BlobCache>> BlobCache::Open(const std::string& directory,
                                                           int64_t max_bytes) {
  LB_ASSIGN_OR_RETURN(auto blobs, OpenLocalBlobStore(directory, Durability::kCache));
  return std::unique_ptr<BlobCache>(new BlobCache(directory, max_bytes, std::move(blobs)));
}

absl::StatusOr<std::shared_ptr<const Blob>> BlobCache::Find(const BlobId& id) {
  auto blob = blobs_->Open(id);
  if (blob.ok()) {
    // The time of modification tells when it was used last. Without it the cache only forgets too
    // early.
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
  const absl::Time used_now = absl::Now() - kUsedNow;
  int64_t num_bytes = 0;
  for (const BlobInfo& info : infos) num_bytes += info.size_bytes;
  std::stable_sort(infos.begin(), infos.end(),
                   [](const BlobInfo& a, const BlobInfo& b) { return a.modified < b.modified; });
  for (const BlobInfo& info : infos) {
    if (num_bytes <= max_bytes_ || info.modified > used_now) break;
    LB_RETURN_IF_ERROR(blobs_->Delete(info.id));
    num_bytes -= info.size_bytes;
  }
  return absl::OkStatus();
}

}  // namespace liquidblend::store
