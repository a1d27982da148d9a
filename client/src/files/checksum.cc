#include "client/src/files/checksum.h"

#include <openssl/evp.h>

#define XXH_INLINE_ALL  // who links the client needs no other library for it
#include <xxhash.h>

#include <array>
#include <new>

#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace liquidblend::client {
namespace {

struct FreeDigest {
  void operator()(EVP_MD_CTX* context) const { EVP_MD_CTX_free(context); }
};

// OpenSSL's digest calls fail only when memory runs out.
void Require(int result) {
  if (result != 1) throw std::bad_alloc();
}

}  // namespace

struct Checksum::State {
  std::unique_ptr<EVP_MD_CTX, FreeDigest> sha256;  // null: XXH3
  XXH3_state_t xxh3;
};

Checksum::Checksum(absl::string_view like) : state_(std::make_unique<State>()) {
  XXH3_128bits_reset(&state_->xxh3);
  if (absl::StartsWith(like, "xxh3-")) return;
  state_->sha256.reset(EVP_MD_CTX_new());
  if (state_->sha256 == nullptr) throw std::bad_alloc();
  Require(EVP_DigestInit_ex(state_->sha256.get(), EVP_sha256(), nullptr));
}

Checksum::~Checksum() = default;

void Checksum::Add(absl::string_view bytes) {
  if (state_->sha256 == nullptr) {
    XXH3_128bits_update(&state_->xxh3, bytes.data(), bytes.size());
  } else {
    Require(EVP_DigestUpdate(state_->sha256.get(), bytes.data(), bytes.size()));
  }
}

std::string Checksum::Text() {
  if (state_->sha256 == nullptr) {
    const XXH128_hash_t hash = XXH3_128bits_digest(&state_->xxh3);
    return absl::StrFormat("xxh3-%016x%016x", hash.high64, hash.low64);
  }
  std::array<unsigned char, 32> digest;
  Require(EVP_DigestFinal_ex(state_->sha256.get(), digest.data(), nullptr));
  return absl::StrCat("sha256-", absl::BytesToHexString(absl::string_view(
                                     reinterpret_cast<const char*>(digest.data()), digest.size())));
}

}  // namespace liquidblend::client
