#include "core/store/blobs/content_hash.h"

#include <openssl/evp.h>
#include <xxhash.h>

#include <array>
#include <new>

#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace liquidblend::store {
namespace {

constexpr size_t kSha256Bytes = 32;

// OpenSSL's digest calls fail only when memory runs out.
void Require(int result) {
  if (result != 1) throw std::bad_alloc();
}

}  // namespace

uint64_t Checksum(std::span<const std::byte> bytes) {
  return XXH3_64bits(bytes.data(), bytes.size());
}

HashKind HashKindOf(const BlobId& id) {
  return absl::StartsWith(id, "sha256-") ? HashKind::kSha256 : HashKind::kXxh3_128;
}

void BlobHasher::Free::operator()(XXH3_state_s* state) const { XXH3_freeState(state); }
void BlobHasher::Free::operator()(evp_md_ctx_st* state) const { EVP_MD_CTX_free(state); }

BlobHasher::BlobHasher(HashKind kind) {
  if (kind == HashKind::kSha256) {
    sha256_.reset(EVP_MD_CTX_new());
    if (sha256_ == nullptr) throw std::bad_alloc();
    Require(EVP_DigestInit_ex(sha256_.get(), EVP_sha256(), nullptr));
  } else {
    xxh3_.reset(XXH3_createState());
    if (xxh3_ == nullptr) throw std::bad_alloc();
    XXH3_128bits_reset(xxh3_.get());
  }
}

void BlobHasher::Add(std::span<const std::byte> bytes) {
  if (sha256_ != nullptr) {
    Require(EVP_DigestUpdate(sha256_.get(), bytes.data(), bytes.size()));
  } else {
    XXH3_128bits_update(xxh3_.get(), bytes.data(), bytes.size());
  }
}

BlobId BlobHasher::Id() const {
  if (xxh3_ != nullptr) {
    const XXH128_hash_t hash = XXH3_128bits_digest(xxh3_.get());
    return absl::StrFormat("xxh3-%016x%016x", hash.high64, hash.low64);
  }
  const std::unique_ptr<evp_md_ctx_st, Free> copy(EVP_MD_CTX_new());
  if (copy == nullptr) throw std::bad_alloc();
  Require(EVP_MD_CTX_copy_ex(copy.get(), sha256_.get()));
  std::array<unsigned char, kSha256Bytes> digest;
  Require(EVP_DigestFinal_ex(copy.get(), digest.data(), nullptr));
  return absl::StrCat("sha256-", absl::BytesToHexString(absl::string_view(
                                     reinterpret_cast<const char*>(digest.data()), digest.size())));
}

}  // namespace liquidblend::store
