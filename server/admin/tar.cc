#include "server/admin/tar.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cstring>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/base/status_macros.h"

namespace liquidblend::admin {
namespace {

constexpr int64_t kBlockBytes = 512;
constexpr size_t kNameBytes = 100;
constexpr int64_t kMaxOctal = int64_t{1} << 33;  // 11 octal digits
constexpr size_t kSizeOffset = 124;
constexpr size_t kSizeBytes = 12;
constexpr size_t kChecksumOffset = 148;
constexpr size_t kChecksumBytes = 8;
constexpr size_t kTypeOffset = 156;
constexpr size_t kMagicOffset = 257;
constexpr size_t kPrefixOffset = 345;
constexpr size_t kPrefixBytes = 155;
constexpr size_t kChunkBytes = size_t{1} << 20;

using Block = std::array<char, kBlockBytes>;

int64_t PaddingOf(int64_t size) { return (kBlockBytes - size % kBlockBytes) % kBlockBytes; }

void Put(const std::string& text, size_t offset, Block& block) {
  std::copy(text.begin(), text.end(), block.begin() + static_cast<ptrdiff_t>(offset));
}

// The sum of the header's bytes, those of the checksum counted as spaces.
int ChecksumOf(const Block& block) {
  int sum = 0;
  for (size_t k = 0; k < block.size(); ++k) {
    const bool is_checksum = k >= kChecksumOffset && k < kChecksumOffset + kChecksumBytes;
    sum += is_checksum ? ' ' : static_cast<unsigned char>(block[k]);
  }
  return sum;
}

// Octal digits or, if they are too few, the number itself after a set bit (GNU's way).
std::string FormatSize(int64_t size) {
  if (size < kMaxOctal) return absl::StrFormat("%011o", size);
  std::string bytes(kSizeBytes, '\0');
  bytes[0] = '\x80';
  for (size_t k = 0; k < sizeof(size); ++k) {
    bytes[kSizeBytes - 1 - k] = static_cast<char>(size >> (8 * k));
  }
  return bytes;
}

// Less than 0: no number.
int64_t ParseNumber(const char* text, size_t length) {
  int64_t value = 0;
  if (static_cast<unsigned char>(text[0]) == 0x80) {
    for (size_t k = length - sizeof(value); k < length; ++k) {
      value = static_cast<int64_t>(static_cast<uint64_t>(value) << 8) |
              static_cast<unsigned char>(text[k]);
    }
    return value;
  }
  for (size_t k = 0; k < length && text[k] != '\0'; ++k) {
    if (text[k] == ' ') continue;
    if (text[k] < '0' || text[k] > '7' || value >= (int64_t{1} << 58)) return -1;
    value = value * 8 + (text[k] - '0');
  }
  return value;
}

std::string TextAt(const Block& block, size_t offset, size_t length) {
  return std::string(block.data() + offset, strnlen(block.data() + offset, length));
}

Block MakeHeader(const std::string& name, int64_t size) {
  assert(name.size() <= kNameBytes);
  Block block = {};
  Put(name, 0, block);
  Put("0000444", 100, block);  // mode
  Put("0000000", 108, block);  // owner
  Put("0000000", 116, block);  // group
  Put(FormatSize(size), kSizeOffset, block);
  Put("00000000000", 136, block);  // time
  block[kTypeOffset] = '0';        // a regular file
  Put(std::string("ustar\0"
                  "00",
                  8),
      kMagicOffset, block);
  Put(absl::StrFormat("%06o", ChecksumOf(block)), kChecksumOffset, block);
  block[kChecksumOffset + 7] = ' ';
  return block;
}

}  // namespace

absl::Status TarWriter::Write(const std::string& bytes) {
  if (out_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()))) return absl::OkStatus();
  return absl::UnavailableError("the archive cannot be written");
}

absl::Status TarWriter::Add(const std::string& name, std::span<const std::byte> bytes) {
  const auto size = static_cast<int64_t>(bytes.size());
  const Block header = MakeHeader(name, size);
  LB_RETURN_IF_ERROR(Write(std::string(header.begin(), header.end())));
  if (!out_.write(reinterpret_cast<const char*>(bytes.data()), size)) {
    return absl::UnavailableError(absl::StrCat("the archive cannot be written, in ", name));
  }
  return Write(std::string(static_cast<size_t>(PaddingOf(size)), '\0'));
}

absl::Status TarWriter::End() {
  LB_RETURN_IF_ERROR(Write(std::string(2 * kBlockBytes, '\0')));
  if (out_.flush()) return absl::OkStatus();
  return absl::UnavailableError("the archive cannot be written");
}

absl::Status TarReader::ReadBlock(std::span<char> block) {
  in_.read(block.data(), static_cast<std::streamsize>(block.size()));
  if (in_.gcount() == static_cast<std::streamsize>(block.size())) return absl::OkStatus();
  return absl::DataLossError("the archive ends early");
}

absl::Status TarReader::Skip() {
  LB_RETURN_IF_ERROR(Read([](auto) { return absl::OkStatus(); }));
  std::vector<char> rest(static_cast<size_t>(padding_));
  padding_ = 0;
  return ReadBlock(rest);
}

absl::StatusOr<std::optional<TarEntry>> TarReader::Next() {
  while (true) {
    LB_RETURN_IF_ERROR(Skip());
    Block block;
    LB_RETURN_IF_ERROR(ReadBlock(block));
    if (has_begun_ && std::all_of(block.begin(), block.end(), [](char c) { return c == '\0'; })) {
      return std::optional<TarEntry>();
    }
    TarEntry entry;
    entry.size_bytes = ParseNumber(block.data() + kSizeOffset, kSizeBytes);
    const int64_t checksum = ParseNumber(block.data() + kChecksumOffset, kChecksumBytes);
    if (checksum != ChecksumOf(block) || entry.size_bytes < 0) {
      if (!has_begun_) return absl::InvalidArgumentError("this is no tar archive");
      return absl::DataLossError("a header of the archive is damaged");
    }
    has_begun_ = true;
    left_bytes_ = entry.size_bytes;
    padding_ = PaddingOf(entry.size_bytes);
    if (block[kTypeOffset] != '0' && block[kTypeOffset] != '\0') continue;
    const std::string prefix = TextAt(block, kPrefixOffset, kPrefixBytes);
    entry.name = absl::StrCat(prefix, prefix.empty() ? "" : "/", TextAt(block, 0, kNameBytes));
    while (entry.name.rfind("./", 0) == 0) entry.name.erase(0, 2);
    return std::optional<TarEntry>(std::move(entry));
  }
}

absl::Status TarReader::Read(Take take) {
  std::vector<char> chunk(std::min(kChunkBytes, static_cast<size_t>(left_bytes_)));
  while (left_bytes_ > 0) {
    const auto size = std::min(chunk.size(), static_cast<size_t>(left_bytes_));
    LB_RETURN_IF_ERROR(ReadBlock(std::span(chunk).first(size)));
    left_bytes_ -= static_cast<int64_t>(size);
    LB_RETURN_IF_ERROR(take(std::as_bytes(std::span(chunk).first(size))));
  }
  return absl::OkStatus();
}

}  // namespace liquidblend::admin
