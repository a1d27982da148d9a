// The libFuzzer target of the reader LIQUIDBLEND_FUZZ_READER.
#include <cstddef>
#include <cstdint>
#include <span>

#include "tests/fuzz/entries.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const liquidblend::fuzz::Entry& entry =
      *liquidblend::fuzz::FindEntry(LIQUIDBLEND_FUZZ_READER);
  entry.run(std::as_bytes(std::span(data, size)));
  return 0;
}
