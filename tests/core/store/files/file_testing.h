// Damaged and dishonest files for the tests of the formats.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "core/mesh/verdict.h"
#include "core/store/blobs/content_hash.h"
#include "tests/core/store/store_testing.h"

namespace liquidblend::store {

// A verdict with every field that the first files had. HasTheSameBytesAsEver depends on it.
inline mesh::Verdict DoubtfulVerdict(double worst_frame) {
  return {.grade = mesh::Grade::kDoubtful,
          .reason = "7 % is not covered",
          .worst = {1, 2, 3, worst_frame},
          .fit_energy = 12,
          .smoothness_energy = 34,
          .residual_histogram = {0.7, 0.1, 0.06, 0.05, 0.04, 0.03, 0.02},
          .compatible_share = 0.99,
          .covered_share = 0.93,
          .unmatched_share = 0.2,
          .stretch = 0.11,
          .inverted_share = 0.001,
          .component_error = 0.5,
          .volume_errors = {0.01, -0.02, 0}};
}

// The hash of a file's bytes.
inline BlobId HashOf(const std::string& file) {
  BlobHasher hasher(HashKind::kXxh3_128);
  hasher.Add(AsBytes(file));
  return hasher.Id();
}

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
