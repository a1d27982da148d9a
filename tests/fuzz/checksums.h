// Makes the checksums of a damaged file right, so that the checks behind them are reached.
#pragma once

#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <vector>

#include "core/store/blobs/content_hash.h"
#include "liquidblend/store/v1/files.pb.h"

namespace liquidblend::fuzz {

// An animation or family file with the checksums of its header and, as far as they lie in the file,
// its sections made right. What is too damaged for that stays as it is.
template <typename Manifest>
std::vector<std::byte> WithRightChecksums(std::span<const std::byte> bytes) {
  constexpr size_t kChecksumAt = 8;
  constexpr size_t kCheckedFrom = 16;
  constexpr size_t kSizeAt = 24;
  constexpr size_t kHeader = 32;
  std::vector<std::byte> file(bytes.begin(), bytes.end());
  uint64_t size = 0;
  if (file.size() < kHeader) return file;
  std::memcpy(&size, &file[kSizeAt], sizeof(size));
  if (size > file.size() - kHeader) return file;
  Manifest manifest;
  if (manifest.ParseFromArray(file.data() + kHeader, static_cast<int>(size))) {
    for (store::v1::Section& section : *manifest.mutable_sections()) {
      const uint64_t element = section.element_bytes();
      if (element == 0 || section.offset() > file.size()) continue;
      if (section.count() > (file.size() - section.offset()) / element) continue;
      section.set_xxh3(
          store::Checksum(std::span(file).subspan(section.offset(), section.count() * element)));
    }
    const std::string changed = manifest.SerializeAsString();
    if (changed.size() == size) std::memcpy(file.data() + kHeader, changed.data(), size);
  }
  const uint64_t checksum =
      store::Checksum(std::span(file).subspan(kCheckedFrom, kHeader + size - kCheckedFrom));
  std::memcpy(&file[kChecksumAt], &checksum, sizeof(checksum));
  return file;
}

}  // namespace liquidblend::fuzz
