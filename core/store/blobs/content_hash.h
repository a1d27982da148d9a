// Hashes of stored content: SHA-256 for names of blobs, XXH3 for checksums.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "core/store/blobs/blob_store.h"

struct XXH3_state_s;
struct evp_md_ctx_st;

namespace liquidblend::store {

// XXH3-64 of the bytes. It detects accidental damage, not attacks.
uint64_t Checksum(std::span<const std::byte> bytes);

// Kind of a content hash.
enum class HashKind {
  kSha256,   // collision-resistant: names of blobs
  kXxh3_128  // not collision-resistant: names of blobs in old stores, fingerprints of our own data
};

// The kind of hash in a blob id or upload id.  Requires: IsBlobId(id) or IsUploadId(id).
HashKind HashKindOf(const BlobId& id);

// Hasher of a sequence of bytes that come in pieces.  Threads: one at a time.
class BlobHasher {
 public:
  // Starts a hash of this kind.
  explicit BlobHasher(HashKind kind = HashKind::kSha256);
  // Adds the next bytes.
  void Add(std::span<const std::byte> bytes);
  // The id, of the kind of this hasher, of a blob with the bytes so far. More bytes may follow.
  BlobId Id() const;

 private:
  struct Free {
    void operator()(XXH3_state_s* state) const;
    void operator()(evp_md_ctx_st* state) const;
  };
  std::unique_ptr<evp_md_ctx_st, Free> sha256_;  // one of the two
  std::unique_ptr<XXH3_state_s, Free> xxh3_;
};

}  // namespace liquidblend::store
