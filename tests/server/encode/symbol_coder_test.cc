#include "server/encode/symbol_coder.h"

#include <draco/compression/bit_coders/rans_bit_decoder.h>
#include <draco/compression/entropy/symbol_decoding.h>
#include <draco/compression/entropy/symbol_encoding.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <utility>

namespace liquidblend::encode::symbol_coder_test {
namespace {

constexpr uint16_t kVersion = DRACO_BITSTREAM_VERSION(2, 2);
// Ours, and libdraco's compression level.
constexpr std::array<std::pair<int, int>, 4> kPrecisions = {{{-2, 3}, {-1, 5}, {0, 7}, {2, 10}}};

std::string ByLibdraco(std::vector<uint32_t> symbols, int num_components, int level) {
  draco::Options options;
  draco::SetSymbolEncodingCompressionLevel(&options, level);
  draco::EncoderBuffer buffer;
  EXPECT_TRUE(draco::EncodeSymbols(symbols.data(), static_cast<int>(symbols.size()), num_components,
                                   &options, &buffer));
  return std::string(buffer.data(), buffer.size());
}

std::vector<uint32_t> Decode(const std::string& data, size_t num_symbols, int num_components) {
  draco::DecoderBuffer buffer;
  buffer.Init(data.data(), data.size(), kVersion);
  std::vector<uint32_t> symbols(num_symbols);
  EXPECT_TRUE(draco::DecodeSymbols(static_cast<uint32_t>(num_symbols), num_components, &buffer,
                                   symbols.data()));
  EXPECT_EQ(buffer.remaining_size(), 0);
  return symbols;
}

// Numbers of random distribution: all the same, a few, many, some of them huge.
std::vector<uint32_t> RandomSymbols(std::mt19937& random) {
  const auto uniform = [&](uint32_t below) {
    return std::uniform_int_distribution<uint32_t>(0, below - 1)(random);
  };
  std::vector<uint32_t> symbols(3 * (1 + uniform(1U << uniform(12))));
  const uint32_t max_bits = 1 + uniform(22);
  const double sharpness = std::exp(uniform(6));
  for (uint32_t& symbol : symbols) {
    const double share = std::pow(uniform(1 << 20) / double{1 << 20}, sharpness);
    symbol = static_cast<uint32_t>(share * (1U << max_bits));
  }
  return symbols;
}

TEST(SymbolCoder, WritesLibdracosBytesForAnyDistribution) {
  std::mt19937 random(1);
  SymbolCoder coder;
  for (int trial = 0; trial < 400; ++trial) {
    const std::vector<uint32_t> symbols = RandomSymbols(random);
    for (const int num_components : {1, 3}) {
      for (const auto& [extra_precision, level] : kPrecisions) {
        std::string data;
        ASSERT_TRUE(coder.Put(symbols, {num_components, extra_precision}, data));
        ASSERT_TRUE(data == ByLibdraco(symbols, num_components, level))
            << "trial " << trial << ", components " << num_components << ", level " << level;
        ASSERT_EQ(Decode(data, symbols.size(), num_components), symbols);
      }
    }
  }
}

TEST(SymbolCoder, AddsToWhatIsThere) {
  SymbolCoder coder;
  std::string data = "before";
  ASSERT_TRUE(coder.Put(std::vector<uint32_t>{7, 7, 7}, {}, data));
  EXPECT_EQ(data.substr(0, 6), "before");
  EXPECT_EQ(Decode(data.substr(6), 3, 1), std::vector<uint32_t>({7, 7, 7}));
}

TEST(SymbolCoder, OnesAreDecodedAsOnes) {
  for (const int count : {0, 1, 2, 31, 32, 33, 1000, 30000}) {
    std::string data;
    PutOnes(count, data);
    draco::DecoderBuffer buffer;
    buffer.Init(data.data(), data.size(), kVersion);
    draco::RAnsBitDecoder decoder;
    ASSERT_TRUE(decoder.StartDecoding(&buffer));
    for (int i = 0; i < count; ++i) ASSERT_TRUE(decoder.DecodeNextBit()) << i << " of " << count;
    EXPECT_EQ(buffer.remaining_size(), 0);
  }
}

}  // namespace
}  // namespace liquidblend::encode::symbol_coder_test
