// Room in the store for all owners together: what they may store (--max-stored), and what has to
// stay free on the disk (--disk-reserve). Knows no gRPC.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/store/blobs/blob_store.h"
#include "core/store/catalog/catalog.h"
#include "server/frames/backends.h"

namespace liquidblend::server {

// Whether new_bytes fit on the disk of the store beside the reserve, if need be after the store has
// let go of copies there; a disk that cannot be asked passes: writing will say what is wrong with
// it. Errors: kResourceExhausted (DISK_RESERVE_REACHED) that names the disk.
absl::Status CheckDisk(store::BlobStore& blobs, const Limits& limits, int64_t new_bytes);

// Bytes stored by all owners (Catalog::ListOwners()); 0 if they are not limited.  Cost:
// O(animations and families).
absl::StatusOr<int64_t> StoredBytes(store::Catalog& catalog, const Limits& limits);

// Whether new_bytes may be stored beside those of all owners.
// Errors: kResourceExhausted (STORE_FULL).
absl::Status CheckStoredBytes(const Limits& limits, int64_t stored_bytes, int64_t new_bytes);

// `refusal`, or OK where the job is a repetition of a request that was accepted before.
// Errors, also: those of the catalog.
absl::Status UnlessAccepted(store::Catalog& catalog, const store::pb::JobRecord& job,
                            const absl::Status& refusal);

// Whether a job may be accepted at all: all of the above, for no bytes yet.
absl::Status CheckStoreSpace(store::Catalog& catalog, store::BlobStore& blobs, const Limits& limits,
                             const store::pb::JobRecord& job);

}  // namespace liquidblend::server
