#include "server/encode/symbol_coder.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstring>

#include "server/encode/bytes.h"

namespace liquidblend::encode {
namespace {

constexpr uint8_t kTagged = 0;  // the bitstream's methods: bit lengths coded, symbols as they are
constexpr uint8_t kRaw = 1;     // symbols coded
constexpr int kMaxRawBits = 18;
constexpr int kTagPrecisionBits = 12;
constexpr int kMinPrecisionBits = 12;
constexpr int kMaxPrecisionBits = 20;
constexpr uint32_t kBitPrecision = 256;  // of PutOnes(): probabilities of a bit are of 8 bits
constexpr uint32_t kBitBase = 4096;

int BitLength(uint32_t value) { return std::max(1, static_cast<int>(std::bit_width(value))); }

// Estimate by libdraco of the size of the table of probabilities.
int64_t TableBits(int64_t max_symbol, int64_t num_different) {
  return 8 * (2 * num_different + (max_symbol - num_different) / 64);
}

// Shannon's entropy in bits, rounded down; added up in libdraco's order.
int64_t EntropyBits(std::span<const uint32_t> frequencies, size_t num_symbols) {
  double bits = 0.0;
  for (const uint32_t frequency : frequencies) {
    if (frequency == 0) continue;
    bits += frequency * std::log2(frequency / static_cast<double>(num_symbols));
  }
  return static_cast<int64_t>(-bits);
}

int CountDifferent(std::span<const uint32_t> frequencies) {
  return static_cast<int>(
      std::count_if(frequencies.begin(), frequencies.end(), [](uint32_t f) { return f > 0; }));
}

// A coder's last state, less its lowest one. The highest two bits are the number of bytes less one.
struct LastState {
  explicit LastState(uint32_t state) {
    num_bytes = state < 1U << 6 ? 1 : state < 1U << 14 ? 2 : state < 1U << 22 ? 3 : 4;
    bytes = state | static_cast<uint32_t>(num_bytes - 1) << (8 * num_bytes - 2);
  }
  uint32_t bytes;  // the lowest first
  int num_bytes;
};

}  // namespace

bool SymbolCoder::Put(std::span<const uint32_t> symbols, const SymbolCoderOptions& options,
                      std::string& out) {
  MeasureBitLengths(symbols, options.num_components);
  const bool is_raw_possible = BitLength(max_symbol_) <= kMaxRawBits;
  if (is_raw_possible) {
    frequencies_.assign(max_symbol_ + 1, 0);
    for (const uint32_t symbol : symbols) ++frequencies_[symbol];
    num_different_ = CountDifferent(frequencies_);
  }
  if (!is_raw_possible || TaggedBits(options.num_components) < RawBits(symbols.size())) {
    return PutTagged(symbols, options.num_components, out);
  }
  return PutRaw(symbols, options.extra_precision, out);
}

void SymbolCoder::MeasureBitLengths(std::span<const uint32_t> symbols, int num_components) {
  bit_lengths_.resize(symbols.size() / num_components);
  bit_length_counts_.fill(0);
  max_symbol_ = 0;
  const uint32_t* symbol = symbols.data();
  for (uint8_t& bit_length : bit_lengths_) {
    uint32_t all = 0;  // as long as the largest
    for (int k = 0; k < num_components; ++k, ++symbol) {
      all |= *symbol;
      max_symbol_ = std::max(max_symbol_, *symbol);
    }
    bit_length = static_cast<uint8_t>(BitLength(all));
    ++bit_length_counts_[bit_length];
  }
}

int64_t SymbolCoder::TaggedBits(int num_components) const {
  int64_t sum = 0;
  for (size_t length = 0; length < bit_length_counts_.size(); ++length) {
    sum += static_cast<int64_t>(length) * bit_length_counts_[length];
  }
  const int num_different = CountDifferent(bit_length_counts_);
  return EntropyBits(bit_length_counts_, bit_lengths_.size()) +
         TableBits(num_different, num_different) + sum * num_components;
}

int64_t SymbolCoder::RawBits(size_t num_symbols) const {
  return EntropyBits(frequencies_, num_symbols) + TableBits(max_symbol_, num_different_);
}

bool SymbolCoder::PutRaw(std::span<const uint32_t> symbols, int extra_precision, std::string& out) {
  const int different_bits = BitLength(static_cast<uint32_t>(num_different_));
  if (different_bits > kMaxRawBits) return false;
  const int bits = std::clamp(different_bits + extra_precision, 1, kMaxRawBits);
  const int precision_bits = std::clamp(3 * bits / 2, kMinPrecisionBits, kMaxPrecisionBits);
  if (!MakeProbabilities(frequencies_, precision_bits)) return false;
  PutByte(kRaw, out);
  PutByte(static_cast<uint8_t>(bits), out);
  PutProbabilities(out);
  PutCoded(symbols, precision_bits, out);
  return true;
}

bool SymbolCoder::PutTagged(std::span<const uint32_t> symbols, int num_components,
                            std::string& out) {
  if (!MakeProbabilities(bit_length_counts_, kTagPrecisionBits)) return false;
  PutByte(kTagged, out);
  PutProbabilities(out);
  PutCoded(std::span<const uint8_t>(bit_lengths_), kTagPrecisionBits, out);
  BitPacker packer(out);
  const uint32_t* symbol = symbols.data();
  for (const uint8_t bit_length : bit_lengths_) {
    for (int k = 0; k < num_components; ++k) packer.Put(*symbol++, bit_length);
  }
  packer.Finish();
  return true;
}

// Makes probabilities from frequencies, as shares of 2^precision_bits, up to the last frequency
// above 0. Symbols that occur have a probability above 0.
bool SymbolCoder::MakeProbabilities(std::span<const uint32_t> frequencies, int precision_bits) {
  while (frequencies.back() == 0) frequencies = frequencies.first(frequencies.size() - 1);
  double num_symbols = 0.0;
  for (const uint32_t frequency : frequencies) num_symbols += frequency;
  const uint32_t aim = 1U << precision_bits;
  probabilities_.resize(frequencies.size());
  uint32_t sum = 0;
  for (size_t s = 0; s < frequencies.size(); ++s) {
    uint32_t& probability = probabilities_[s].probability;
    probability = static_cast<uint32_t>(frequencies[s] / num_symbols * aim + 0.5);
    if (probability == 0 && frequencies[s] > 0) probability = 1;
    sum += probability;
  }
  if (!FitProbabilities(sum, aim)) return false;
  MakeReciprocals(precision_bits);
  return true;
}

// Corrects the probabilities until their sum is `aim`, as libdraco does. What is missing is added
// to the most frequent symbol. An excess is taken from all, the most frequent first.
bool SymbolCoder::FitProbabilities(uint32_t sum, uint32_t aim) {
  by_probability_.clear();  // those above 1: the others are as they must be
  for (size_t s = 0; s < probabilities_.size(); ++s) {
    const uint64_t probability = probabilities_[s].probability;
    if (probability > 1) by_probability_.push_back(probability << 32 | s);
  }
  if (sum != aim && by_probability_.empty()) return false;
  std::sort(by_probability_.begin(), by_probability_.end());
  const auto of = [&](size_t i) -> uint32_t& {
    return probabilities_[static_cast<uint32_t>(by_probability_[i])].probability;
  };
  if (sum < aim) of(by_probability_.size() - 1) += aim - sum;
  // If all symbols are above 1, libdraco takes nothing from the least frequent one.
  const size_t first = by_probability_.size() == probabilities_.size() ? 1 : 0;
  while (sum > aim) {
    const double scale = static_cast<double>(aim) / sum;
    const uint32_t sum_before = sum;
    for (size_t i = by_probability_.size(); i > first && sum > aim; --i) {
      uint32_t& probability = of(i - 1);
      if (probability <= 1) break;
      const auto scaled = static_cast<uint32_t>(std::floor(scale * probability));
      const uint32_t excess = std::clamp(probability - scaled, 1U, probability - 1);
      const uint32_t taken = std::min(excess, sum - aim);
      probability -= taken;
      sum -= taken;
    }
    if (sum == sum_before) return false;
  }
  return true;
}

// Makes reciprocals for division by multiplication, exact for states below 2^31: F. Giesen, "rANS
// with static probability distributions". With a probability of 1 the quotient is one too small;
// the bias corrects that.
void SymbolCoder::MakeReciprocals(int precision_bits) {
  uint32_t before = 0;
  for (Probability& p : probabilities_) {
    p.bias = before;
    p.reciprocal = ~0U;
    p.shift = 0;
    before += p.probability;
    if (p.probability == 1) p.bias += (1U << precision_bits) - 1;
    if (p.probability <= 1) continue;
    p.shift = static_cast<uint32_t>(std::bit_width(p.probability - 1)) - 1;
    p.reciprocal = static_cast<uint32_t>(((uint64_t{1} << (p.shift + 32)) + p.probability - 1) /
                                         p.probability);
  }
}

// Appends the probabilities. The lowest two bits of a byte are the number of bytes that follow, or
// 3: then it is a run of zeros.
void SymbolCoder::PutProbabilities(std::string& out) const {
  PutVarint(probabilities_.size(), out);
  for (size_t s = 0; s < probabilities_.size(); ++s) {
    const uint32_t probability = probabilities_[s].probability;
    if (probability == 0) {
      uint8_t run = 0;  // beyond the first zero
      while (run < 63 && probabilities_[s + 1].probability == 0) ++run, ++s;
      PutByte(static_cast<uint8_t>(run << 2 | 3), out);
      continue;
    }
    const int num_extra = probability < 1U << 6 ? 0 : probability < 1U << 14 ? 1 : 2;
    PutByte(static_cast<uint8_t>(probability << 2 | static_cast<uint32_t>(num_extra)), out);
    for (int b = 0; b < num_extra; ++b) {
      PutByte(static_cast<uint8_t>(probability >> (8 * b + 6)), out);
    }
  }
}

// Appends the coded symbols. They are coded from the last to the first, so that the decoder gets
// them in order.
template <typename Symbol>
void SymbolCoder::PutCoded(std::span<const Symbol> symbols, int precision_bits, std::string& out) {
  constexpr size_t kMaxBytes = 3;  // per symbol; one more is written than counts
  if (coded_.size() < kMaxBytes * symbols.size() + 8) {
    coded_.resize(kMaxBytes * symbols.size() + 8);
  }
  const uint32_t precision = 1U << precision_bits;
  uint32_t state = 4 * precision;
  uint8_t* end = coded_.data();
  for (size_t i = symbols.size(); i > 0; --i) {
    const Probability& p = probabilities_[symbols[i - 1]];
    while (state >= p.probability << 10) {
      *end++ = static_cast<uint8_t>(state);
      state >>= 8;
    }
    const auto quotient = static_cast<uint32_t>((uint64_t{state} * p.reciprocal) >> 32) >> p.shift;
    state += p.bias + quotient * (precision - p.probability);
  }
  const LastState last(state - 4 * precision);
  std::memcpy(end, &last.bytes, sizeof(last.bytes));
  const auto num_bytes = static_cast<size_t>(end + last.num_bytes - coded_.data());
  PutVarint(num_bytes, out);
  out.append(reinterpret_cast<const char*>(coded_.data()), num_bytes);
}

void PutOnes(int count, std::string& out) {
  constexpr uint32_t kZeroShare = 1;  // of kBitPrecision, the least there is
  constexpr uint32_t kOneShare = kBitPrecision - kZeroShare;
  std::string coded;
  uint32_t state = kBitBase;
  for (int i = 0; i < count; ++i) {
    if (state >= kBitBase * kOneShare) {
      PutByte(static_cast<uint8_t>(state), coded);
      state >>= 8;
    }
    state = state / kOneShare * kBitPrecision + state % kOneShare;
  }
  LastState last(state - kBitBase);
  for (; last.num_bytes > 0; --last.num_bytes, last.bytes >>= 8) {
    PutByte(static_cast<uint8_t>(last.bytes), coded);
  }
  PutByte(kZeroShare, out);
  PutVarint(coded.size(), out);
  out.append(coded);
}

}  // namespace liquidblend::encode
