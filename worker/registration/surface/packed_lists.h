// Lists of indices in a packed form. Internal to worker/registration.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <vector>

#include "absl/functional/function_ref.h"
#include "core/parallel/arena.h"

namespace liquidblend::registration {

// Lists of indices, one per row. An index is stored as its difference from the one before, in as
// few bytes as possible, so ascending lists are smallest. Neighbours in a mesh take a third of the
// memory of plain numbers.
//
// A list's bytes: its size, two bits for each index, which say how long its distance is (four to a
// byte, the lowest bits first), and the distances, of 0, 1, 2 or 4 bytes, the lowest byte first.
class PackedLists {
 public:
  class Iterator {
   public:
    using difference_type = std::ptrdiff_t;
    using value_type = int32_t;
    Iterator() = default;
    explicit Iterator(uint32_t n) : n_(n) {}
    Iterator(const uint8_t* codes, const uint8_t* distances)
        : distances_(distances), next_codes_(codes) {
      ReadCodes();
    }
    int32_t operator*() const {
      uint32_t distance;
      std::memcpy(&distance, distances_, sizeof distance);
      return static_cast<int32_t>(before_ + 1 + (distance & kMask[codes_ & 3]));
    }
    Iterator& operator++() {
      before_ = static_cast<uint32_t>(**this);
      distances_ += kLength[codes_ & 3];
      codes_ >>= 2;
      if (++n_ % kCodesAtOnce == 0) ReadCodes();
      return *this;
    }
    Iterator operator++(int) {
      const Iterator old = *this;
      ++*this;
      return old;
    }
    bool operator==(const Iterator& other) const { return n_ == other.n_; }

   private:
    static constexpr uint32_t kCodesAtOnce = 32;
    void ReadCodes() {
      std::memcpy(&codes_, next_codes_, sizeof codes_);
      next_codes_ += sizeof codes_;
    }

    uint64_t codes_ = 0;
    const uint8_t* distances_ = nullptr;
    const uint8_t* next_codes_ = nullptr;
    uint32_t before_ = ~0U;  // the index before; the first one's is -1
    uint32_t n_ = 0;
  };

  class List {
   public:
    explicit List(const uint8_t* bytes) : size_(*bytes), codes_(bytes + 1) {
      if (size_ < kLong) return;
      std::memcpy(&size_, codes_, sizeof size_);
      codes_ += sizeof size_;
    }
    Iterator begin() const { return {codes_, codes_ + (size_ + 3) / 4}; }
    Iterator end() const { return Iterator(size_); }
    size_t size() const { return size_; }
    bool empty() const { return size_ == 0; }

   private:
    uint32_t size_;
    const uint8_t* codes_;
  };

  PackedLists() = default;
  // fill(row, list) appends a row's indices to an empty list.
  // Threads: calls fill() on several; same bytes for any thread count.
  PackedLists(int64_t num_rows, const parallel::Arena& arena,
              absl::FunctionRef<void(int64_t, std::vector<int32_t>&)> fill);

  int64_t num_rows() const { return num_rows_; }
  size_t num_bytes() const;  // of memory
  bool operator==(const PackedLists&) const = default;
  List operator[](int64_t row) const {
    const Chunk& chunk = chunks_[row / kChunkRows];
    return List(&chunk.bytes[chunk.begin[row % kChunkRows]]);
  }
  // Begin of a list's bytes, for prefetching.
  const void* bytes(int64_t row) const {
    const Chunk& chunk = chunks_[row / kChunkRows];
    return &chunk.bytes[chunk.begin[row % kChunkRows]];
  }

 private:
  static constexpr int64_t kChunkRows = 4096;
  static constexpr uint32_t kLong = 255;  // marks lists this long or longer: 4 bytes of size follow
  static constexpr std::array<uint32_t, 4> kMask = {0, 0xFF, 0xFFFF, 0xFFFFFFFF};
  static constexpr std::array<uint8_t, 4> kLength = {0, 1, 2, 4};
  struct Chunk {
    std::vector<uint32_t> begin;  // per row
    std::vector<uint8_t> bytes;
    bool operator==(const Chunk&) const = default;
  };
  static void Append(const std::vector<int32_t>& list, std::vector<uint8_t>& bytes);

  int64_t num_rows_ = 0;
  std::vector<Chunk> chunks_;
};

}  // namespace liquidblend::registration
