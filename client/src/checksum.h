// Checksums of files, as servers name what they store.
#pragma once

#include <memory>
#include <string>

#include "absl/strings/string_view.h"

namespace liquidblend::client {

// "xxh3-" and the XXH3-128 of the bytes that went by, in hexadecimal digits.
class Checksum {
 public:
  Checksum();
  ~Checksum();
  void Add(absl::string_view bytes);
  std::string Text() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace liquidblend::client
