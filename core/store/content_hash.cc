#include "core/store/content_hash.h"

#include <xxhash.h>

#include "absl/strings/str_format.h"

namespace liquidblend::store {

uint64_t Checksum(std::span<const std::byte> bytes) {
  return XXH3_64bits(bytes.data(), bytes.size());
}

void BlobHasher::Free::operator()(XXH3_state_s* state) const { XXH3_freeState(state); }

BlobHasher::BlobHasher() : state_(XXH3_createState()) { XXH3_128bits_reset(state_.get()); }

void BlobHasher::Add(std::span<const std::byte> bytes) {
  XXH3_128bits_update(state_.get(), bytes.data(), bytes.size());
}

BlobId BlobHasher::Id() const {
  const XXH128_hash_t hash = XXH3_128bits_digest(state_.get());
  return absl::StrFormat("xxh3-%016x%016x", hash.high64, hash.low64);
}

}  // namespace liquidblend::store
