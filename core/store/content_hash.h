// Checksums of what is stored.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "core/store/blob_store.h"

struct XXH3_state_s;

namespace liquidblend::store {

// XXH3-64 of the bytes.
uint64_t Checksum(std::span<const std::byte> bytes);

// Names a blob while its bytes go by.
class BlobHasher {
 public:
  BlobHasher();
  void Add(std::span<const std::byte> bytes);
  BlobId Id() const;

 private:
  struct Free {
    void operator()(XXH3_state_s* state) const;
  };
  std::unique_ptr<XXH3_state_s, Free> state_;
};

}  // namespace liquidblend::store
