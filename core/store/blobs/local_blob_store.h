// The local blob store of a cache, which can make room when its disk is full.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "core/store/blobs/blob_store.h"

namespace liquidblend::store {

// Called by writers when the disk has refused a write of so many bytes (0: of a name) for lack of
// space. Returns whether something was removed, so that the write is tried again; if that is
// refused as well, it is called again. Threads: has to be safe.
using RoomMaker = std::function<bool(int64_t num_bytes)>;

// Opens the blob store of a cache (Durability::kCache).  Requires: what make_room refers to
// outlives the store and its writers.
absl::StatusOr<std::unique_ptr<BlobStore>> OpenCacheBlobStore(const std::string& directory,
                                                              RoomMaker make_room);

}  // namespace liquidblend::store
