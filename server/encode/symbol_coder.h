// Symbol coder: numbers from 0 on, small ones the more frequent -> bytes, by range asymmetric
// numeral systems (rANS; J. Duda, arXiv 1311.2540; Draco bitstream specification 2.2, "Symbol
// decoding" and "rANS decoding").
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace liquidblend::encode {

// Options of coding symbols.
struct SymbolCoderOptions {
  int num_components = 1;  // >= 1; numbers that share a bit length where tags are used
  // Added to the bit length of the number of different symbols, from which the precision of their
  // probabilities follows: libdraco's choice is -2 at speed 7 and 0 at speed 4.
  int extra_precision = 0;  // [-2, 2]
};

// Coder of symbols. Makes the same decisions as libdraco 1.5, so it writes the same bytes. Keeps
// its memory.
class SymbolCoder {
 public:
  // Appends the symbols to out. Returns false if there are too many different symbols for the
  // format.
  // Requires: symbols are not empty, as many as a multiple of num_components; all < 2^31.
  // Cost: O(symbols + largest symbol), 2^18 at most of the latter.
  bool Put(std::span<const uint32_t> symbols, const SymbolCoderOptions& options, std::string& out);

 private:
  struct Probability {
    uint32_t probability;  // out of 2^precision_bits
    uint32_t bias;         // the probabilities of lower symbols; see MakeReciprocals
    uint32_t reciprocal;   // of the probability
    uint32_t shift;
  };

  void MeasureBitLengths(std::span<const uint32_t> symbols, int num_components);
  int64_t TaggedBits(int num_components) const;
  int64_t RawBits(size_t num_symbols) const;
  bool PutRaw(std::span<const uint32_t> symbols, int extra_precision, std::string& out);
  bool PutTagged(std::span<const uint32_t> symbols, int num_components, std::string& out);
  bool MakeProbabilities(std::span<const uint32_t> frequencies, int precision_bits);
  bool FitProbabilities(uint32_t sum, uint32_t aim);
  void MakeReciprocals(int precision_bits);
  void PutProbabilities(std::string& out) const;
  template <typename Symbol>
  void PutCoded(std::span<const Symbol> symbols, int precision_bits, std::string& out);

  std::vector<uint8_t> bit_lengths_;  // per group of num_components symbols, of its largest
  std::array<uint32_t, 33> bit_length_counts_;
  uint32_t max_symbol_ = 0;
  std::vector<uint32_t> frequencies_;  // per symbol
  int num_different_ = 0;
  std::vector<Probability> probabilities_;  // per symbol
  std::vector<uint64_t> by_probability_;
  std::vector<uint8_t> coded_;
};

// Appends `count` ones as libdraco's coder of single bits writes them ("RAns bit decoder").
void PutOnes(int count, std::string& out);

}  // namespace liquidblend::encode
