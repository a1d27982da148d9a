#include "worker/registration/surface/packed_lists.h"

#include <algorithm>
#include <bit>

namespace liquidblend::registration {
namespace {

void AppendNumber(uint32_t number, size_t num_bytes, std::vector<uint8_t>& bytes) {
  static_assert(std::endian::native == std::endian::little);
  const size_t at = bytes.size();
  bytes.resize(at + num_bytes);
  std::memcpy(bytes.data() + at, &number, num_bytes);
}

}  // namespace

PackedLists::PackedLists(int64_t num_rows, const parallel::Arena& arena,
                         absl::FunctionRef<void(int64_t, std::vector<int32_t>&)> fill)
    : num_rows_(num_rows), chunks_((num_rows + kChunkRows - 1) / kChunkRows) {
  arena.ForChunks(num_rows, kChunkRows, [&](int64_t n, int64_t begin, int64_t end) {
    std::vector<int32_t> list;
    std::vector<uint8_t> bytes;
    chunks_[n].begin.reserve(end - begin);
    for (int64_t row = begin; row < end; ++row) {
      list.clear();
      fill(row, list);
      chunks_[n].begin.push_back(static_cast<uint32_t>(bytes.size()));
      Append(list, bytes);
    }
    bytes.resize(bytes.size() + sizeof(uint64_t), 0);     // what is read beyond the last list
    chunks_[n].bytes.assign(bytes.begin(), bytes.end());  // no more than it needs
  });
}

size_t PackedLists::num_bytes() const {
  size_t num_bytes = 0;
  for (const Chunk& chunk : chunks_) {
    num_bytes += sizeof chunk + sizeof(uint32_t) * chunk.begin.capacity() + chunk.bytes.capacity();
  }
  return num_bytes;
}

void PackedLists::Append(const std::vector<int32_t>& list, std::vector<uint8_t>& bytes) {
  const auto size = static_cast<uint32_t>(list.size());
  bytes.push_back(static_cast<uint8_t>(std::min(size, kLong)));
  if (size >= kLong) AppendNumber(size, sizeof size, bytes);
  const size_t lengths = bytes.size();
  bytes.resize(lengths + (size + 3) / 4, 0);
  uint32_t before = ~0U;
  for (uint32_t n = 0; n < size; ++n) {
    const auto index = static_cast<uint32_t>(list[n]);
    const uint32_t distance = index - before - 1;
    uint32_t code = 0;
    while (distance > kMask[code]) ++code;
    bytes[lengths + n / 4] |= static_cast<uint8_t>(code << 2 * (n % 4));
    AppendNumber(distance, kLength[code], bytes);
    before = index;
  }
}

}  // namespace liquidblend::registration
