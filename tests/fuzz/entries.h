// What the fuzzers and the replay of their findings call: bytes in, each reader's promises checked.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>

namespace liquidblend::fuzz {

struct Entry {
  std::string_view name;  // of the folders in tests/fuzz/corpus and tests/fuzz/regressions, too
  // Reads the bytes; ends the process if what is accepted is not what the reader promises.
  void (*run)(std::span<const std::byte> bytes);
};

std::span<const Entry> Entries();

// Null if there is none of that name.
const Entry* FindEntry(std::string_view name);

}  // namespace liquidblend::fuzz
