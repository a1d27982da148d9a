// Checksums of files, as servers name what they store.
#pragma once

#include <memory>
#include <string>

#include "absl/strings/string_view.h"

namespace liquidblend::client {

// Hashes the bytes that pass.  Threads: one at a time.
class Checksum {
 public:
  // like: a checksum of the kind to be made: "sha256-...", or "xxh3-..." of older stores.
  explicit Checksum(absl::string_view like = "sha256-");
  ~Checksum();
  void Add(absl::string_view bytes);
  // The kind, and the hash in hexadecimal digits. Call it last.
  std::string Text();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace liquidblend::client
