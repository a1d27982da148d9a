// Checksums of files, in the form of the server's blob ids.
#pragma once

#include <memory>
#include <string>

#include "absl/strings/string_view.h"

namespace liquidblend::client {

// Hashes a sequence of bytes.  Threads: one at a time.
class Checksum {
 public:
  // like: a checksum of the kind to be made: "sha256-...", or "xxh3-..." of older stores.
  explicit Checksum(absl::string_view like = "sha256-");
  ~Checksum();
  void Add(absl::string_view bytes);
  // The kind, and the hash in hexadecimal digits. To be called last.
  std::string Text();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace liquidblend::client
