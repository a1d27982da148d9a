#include "client/src/checksum.h"

#define XXH_INLINE_ALL  // who links the client needs no other library for it
#include <xxhash.h>

#include "absl/strings/str_format.h"

namespace liquidblend::client {

struct Checksum::State {
  XXH3_state_t xxh3;
};

Checksum::Checksum() : state_(std::make_unique<State>()) { XXH3_128bits_reset(&state_->xxh3); }
Checksum::~Checksum() = default;

void Checksum::Add(absl::string_view bytes) {
  XXH3_128bits_update(&state_->xxh3, bytes.data(), bytes.size());
}

std::string Checksum::Text() const {
  const XXH128_hash_t hash = XXH3_128bits_digest(&state_->xxh3);
  return absl::StrFormat("xxh3-%016x%016x", hash.high64, hash.low64);
}

}  // namespace liquidblend::client
