// Limits of the store for all owners together: stored bytes (--max-stored), and free space on the
// disk (--disk-reserve). Knows no gRPC.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/store/blobs/blob_store.h"
#include "core/store/catalog/catalog.h"
#include "server/frames/backends.h"

namespace liquidblend::server {

// Checks that new_bytes fit on the disk of the store beside the reserve, if need be after the store
// has removed cached copies there. A disk whose space cannot be read passes, as writing will return
// its error. Errors: kResourceExhausted (DISK_RESERVE_REACHED) that names the disk.
absl::Status CheckDisk(store::BlobStore& blobs, const Limits& limits, int64_t new_bytes);

// Bytes stored by all owners (Catalog::ListOwners()); 0 if they are not limited.  Cost:
// O(animations and families).
absl::StatusOr<int64_t> StoredBytes(store::Catalog& catalog, const Limits& limits);

// Checks that new_bytes may be stored beside those of all owners.
// Errors: kResourceExhausted (STORE_FULL).
absl::Status CheckStoredBytes(const Limits& limits, int64_t stored_bytes, int64_t new_bytes);

// `refusal`, or OK where the job is a repetition of a request that was accepted before.
// Errors, also: those of the catalog.
absl::Status UnlessAccepted(store::Catalog& catalog, const store::pb::JobRecord& job,
                            const absl::Status& refusal);

// All checks above for a job without bytes of its own.
absl::Status CheckStoreSpace(store::Catalog& catalog, store::BlobStore& blobs, const Limits& limits,
                             const store::pb::JobRecord& job);

}  // namespace liquidblend::server
