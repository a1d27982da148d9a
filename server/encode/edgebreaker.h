// The connectivity of a closed surface as Edgebreaker symbols (J. Rossignac 1999; A. Szymczak 2002
// for valences as contexts; Draco bitstream specification 2.2, "EdgeBreaker decoder").
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "server/encode/corner_table.h"
#include "server/encode/symbol_coder.h"

namespace liquidblend::encode {

// Method of coding symbols, with its number in the bitstream.
enum class EdgebreakerMethod : uint8_t {  // as the bitstream numbers them
  kStandard = 0,                          // symbols of 1 or 3 bits
  kValence = 2,                           // entropy-coded, by the valence of the vertex ahead
};

// Encoder of connectivity. Keeps its memory from one surface to the next.
class Edgebreaker {
 public:
  // Appends the connectivity as libdraco does, byte for byte, from the method's number on. Returns
  // false, with `out` undefined, if the decoder would refuse it: a component of two triangles.
  bool Put(const CornerTable& table, EdgebreakerMethod method, SymbolCoder& coder,
           std::string& out);

  // Of the last Put(), per component: the corner from which the decoder walks over it first.
  const std::vector<int32_t>& last_corners() const { return last_corners_; }

 private:
  static constexpr int kMinValence = 2;  // of the contexts; other valences count as the nearest
  static constexpr int kMaxValence = 7;

  // A reunion of the walk with a triangle at which it had split before: one end of a handle.
  struct Reunion {
    int32_t symbol;  // by number
    int32_t split_symbol;
    bool is_on_right;
  };

  struct NoContexts;
  struct ValenceContexts;

  bool IsDone(int32_t triangle) const { return (triangle_state_[triangle] & 1) != 0; }
  void Reset(const CornerTable& table);
  void ResetContexts(const CornerTable& table);
  template <typename Contexts>
  bool WalkAll(const CornerTable& table, Contexts contexts);
  // Returns the last corner.
  template <typename Contexts>
  int32_t Walk(const CornerTable& table, int32_t corner, Contexts& contexts);
  template <typename Contexts>
  int32_t Step(const CornerTable& table, int32_t corner, Contexts& contexts);
  template <uint8_t kSymbol, typename Contexts>
  void Add(int32_t corner, Contexts& contexts);
  void NoteReunion(int32_t neighbor, bool is_on_right);
  void PutReunions(std::string& out) const;
  void PutSymbols(std::string& out) const;
  bool PutContexts(SymbolCoder& coder, std::string& out) const;

  std::vector<uint8_t> symbols_;  // in order; the first num_symbols_ are
  int32_t num_symbols_ = 0;
  int32_t num_splits_ = 0;
  std::vector<int32_t> last_corners_;    // per component
  std::vector<Reunion> reunions_;        // by symbol
  std::vector<uint8_t> triangle_state_;  // see .cc
  std::vector<uint8_t> is_vertex_done_;
  std::vector<int32_t> split_symbol_;  // per triangle at which the walk split
  std::vector<int32_t> stack_;         // corners where the walk continues later

  // Valences in the part that is not yet coded; vertices at which the walk splits become two.
  std::vector<int32_t> valences_;
  std::vector<int32_t> split_vertex_;  // by corner, where its triangle's state says so
  std::array<std::vector<uint32_t>, kMaxValence - kMinValence + 1> context_symbols_;
};

}  // namespace liquidblend::encode
