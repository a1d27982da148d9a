// Damaged and dishonest files for the tests of the formats.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "core/store/content_hash.h"
#include "tests/core/store/store_testing.h"

namespace liquidblend::store {

// The file with its manifest changed and all checksums of header and manifest right again, as far
// as a writer with bad intentions can get. The sections stay where they are: the change must not
// make the manifest longer or shorter than the padding behind it can take.
template <typename Manifest>
std::string WithManifest(const std::string& file, const std::function<void(Manifest&)>& change) {
  constexpr size_t kHeader = 32;
  uint64_t size = 0;
  std::memcpy(&size, file.data() + 24, sizeof(size));
  Manifest manifest;
  EXPECT_TRUE(manifest.ParseFromString(file.substr(kHeader, size)));
  const size_t old_begin = (kHeader + size + 63) / 64 * 64;
  change(manifest);
  const std::string changed = manifest.SerializeAsString();
  std::string head = file.substr(0, kHeader) + changed;
  size = changed.size();
  std::memcpy(head.data() + 24, &size, sizeof(size));
  const uint64_t checksum = Checksum(AsBytes(head).subspan(16));
  std::memcpy(head.data() + 8, &checksum, sizeof(checksum));
  head.resize((head.size() + 63) / 64 * 64, '\0');
  return head + file.substr(std::min(old_begin, file.size()));
}

}  // namespace liquidblend::store
