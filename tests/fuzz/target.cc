// The libFuzzer target LIQUIDBLEND_FUZZ_TARGET, of the table LIQUIDBLEND_FUZZ_ENTRIES.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "tests/fuzz/entries.h"

namespace {

const liquidblend::fuzz::Entry& FindEntry(std::string_view name) {
  const auto entries = liquidblend::fuzz::LIQUIDBLEND_FUZZ_ENTRIES();
  return *std::find_if(entries.begin(), entries.end(),
                       [&](const auto& entry) { return entry.name == name; });
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const liquidblend::fuzz::Entry& entry = FindEntry(LIQUIDBLEND_FUZZ_TARGET);
  entry.run(std::as_bytes(std::span(data, size)));
  return 0;
}
