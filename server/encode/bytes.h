// Encoding of numbers in a Draco bitstream (Draco bitstream specification 2.2, "Conventions").
#pragma once

#include <cstdint>
#include <cstring>
#include <string>

namespace liquidblend::encode {

// Appends a byte.
inline void PutByte(uint8_t byte, std::string& out) { out.push_back(static_cast<char>(byte)); }

// Appends a value as in memory: little-endian.
template <typename Value>
void PutValue(const Value& value, std::string& out) {
  char bytes[sizeof(Value)];
  std::memcpy(bytes, &value, sizeof(Value));
  out.append(bytes, sizeof(Value));
}

// Appends seven bits a byte, the lowest first; all bytes but the last have their highest bit set.
inline void PutVarint(uint64_t value, std::string& out) {
  for (; value >= 0x80; value >>= 7) PutByte(static_cast<uint8_t>(value | 0x80), out);
  PutByte(static_cast<uint8_t>(value), out);
}

// Packs numbers of up to 32 bits, the lowest bit first.
class BitPacker {
 public:
  explicit BitPacker(std::string& out) : out_(out) {}

  // Requires: value < 2^num_bits, num_bits <= 32.
  void Put(uint32_t value, int num_bits) {
    bits_ |= static_cast<uint64_t>(value) << num_bits_;
    num_bits_ += num_bits;
    if (num_bits_ < 32) return;
    PutValue(static_cast<uint32_t>(bits_), out_);
    bits_ >>= 32;
    num_bits_ -= 32;
  }

  // Fills the last byte with zeros. To be called once, at the end.
  void Finish() {
    for (; num_bits_ > 0; num_bits_ -= 8) {
      PutByte(static_cast<uint8_t>(bits_), out_);
      bits_ >>= 8;
    }
  }

 private:
  std::string& out_;
  uint64_t bits_ = 0;
  int num_bits_ = 0;
};

}  // namespace liquidblend::encode
