#include "server/api/store_space.h"

#include "absl/strings/str_cat.h"
#include "core/base/disk_space.h"
#include "core/base/log.h"
#include "core/base/memory_limit.h"
#include "core/base/status_macros.h"
#include "server/base/errors.h"

namespace liquidblend::server {

namespace {

// Space of the disk, after the removal of cached copies if too little was free.
absl::StatusOr<base::DiskSpace> SpaceFor(store::BlobStore& blobs, const std::string& path,
                                         int64_t wanted_bytes) {
  absl::StatusOr<base::DiskSpace> disk = base::ReadDiskSpace(path);
  if (!disk.ok() || disk->free_bytes >= wanted_bytes) return disk;
  const absl::Status made = blobs.MakeRoom(wanted_bytes);
  if (!made.ok()) base::LogWarning(made.ToString());
  return base::ReadDiskSpace(path);
}

}  // namespace

absl::Status CheckDisk(store::BlobStore& blobs, const Limits& limits, int64_t new_bytes) {
  if (limits.disk.empty() || limits.disk_reserve_bytes == 0) return absl::OkStatus();
  const auto disk = SpaceFor(blobs, limits.disk, limits.disk_reserve_bytes + new_bytes);
  if (!disk.ok() || disk->free_bytes - new_bytes >= limits.disk_reserve_bytes) {
    return absl::OkStatus();
  }
  return WithReason(
      absl::ResourceExhaustedError(absl::StrCat(
          "the disk of '", limits.disk, "' has ", base::FormatGibibytes(disk->free_bytes),
          " free, of which ", base::FormatGibibytes(limits.disk_reserve_bytes),
          " are kept in reserve",
          new_bytes > 0 ? absl::StrCat("; uploads need ", new_bytes, " more") : "",
          ": delete animations or families, or ask the operator for room (--disk-reserve)")),
      "DISK_RESERVE_REACHED",
      {{"disk", limits.disk},
       {"free", absl::StrCat(disk->free_bytes)},
       {"reserve", absl::StrCat(limits.disk_reserve_bytes)},
       {"needed", absl::StrCat(new_bytes)}});
}

absl::StatusOr<int64_t> StoredBytes(store::Catalog& catalog, const Limits& limits) {
  if (limits.max_stored_bytes == 0) return 0;
  LB_ASSIGN_OR_RETURN(const std::vector<store::OwnerUse> owners, catalog.ListOwners());
  int64_t sum = 0;
  for (const store::OwnerUse& owner : owners) sum += owner.stored_bytes;
  return sum;
}

absl::Status CheckStoredBytes(const Limits& limits, int64_t stored_bytes, int64_t new_bytes) {
  const int64_t left = limits.max_stored_bytes - stored_bytes;
  if (limits.max_stored_bytes == 0 || (left > 0 && new_bytes <= left)) return absl::OkStatus();
  return WithReason(
      absl::ResourceExhaustedError(absl::StrCat(
          "all owners together may have ", limits.max_stored_bytes, " bytes stored and have ",
          stored_bytes, new_bytes > 0 ? absl::StrCat("; ", new_bytes, " more would be needed") : "",
          ": delete animations or families, or ask the operator for room (--max-stored)")),
      "STORE_FULL",
      {{"limit", absl::StrCat(limits.max_stored_bytes)},
       {"used", absl::StrCat(stored_bytes)},
       {"needed", absl::StrCat(new_bytes)}});
}

absl::Status UnlessAccepted(store::Catalog& catalog, const store::pb::JobRecord& job,
                            const absl::Status& refusal) {
  if (refusal.ok() || job.request_id().empty()) return refusal;
  return catalog.CheckOwner(job, [&](const store::OwnerUse&) { return refusal; });
}

absl::Status CheckStoreSpace(store::Catalog& catalog, store::BlobStore& blobs, const Limits& limits,
                             const store::pb::JobRecord& job) {
  absl::Status status = CheckDisk(blobs, limits, 0);
  if (status.ok()) {
    LB_ASSIGN_OR_RETURN(const int64_t stored_bytes, StoredBytes(catalog, limits));
    status = CheckStoredBytes(limits, stored_bytes, 0);
  }
  return UnlessAccepted(catalog, job, status);
}

}  // namespace liquidblend::server
