#include "server/encode/edgebreaker.h"

#include <algorithm>

#include "server/encode/bytes.h"

namespace liquidblend::encode {
namespace {

// Bits of a triangle's state. The highest three are for its corners: if set, the corner's vertex is
// in split_vertex_, not the table's.
enum TriangleState : uint8_t { kDone = 1, kSplit = 2, kOtherVertex = 4 };

// Symbol of a triangle: its tip is a new vertex (C); else the neighbours that are still to do are
// both (S), the right one (L), the left one (R), or none (E).
enum Symbol : uint8_t { kC, kS, kL, kR, kE };

constexpr int32_t kNone = -1;

struct Pattern {
  uint8_t bits;
  uint8_t num_bits;
};
constexpr std::array<Pattern, 5> kPatterns = {{{0, 1}, {1, 3}, {3, 3}, {5, 3}, {7, 3}}};

}  // namespace

struct Edgebreaker::NoContexts {
  template <uint8_t kSymbol>
  void Note(int32_t /*corner*/) {}
};

// Contexts by valences. The decoder goes from the last symbol to the first, and knows the valences
// of the triangles that it has. So the context of each symbol is the valence, among these
// triangles, of the vertex ahead of the symbol after it.
struct Edgebreaker::ValenceContexts {
  Edgebreaker& walk;
  const CornerTable& table;
  int previous = -1;  // symbol

  template <uint8_t kSymbol>
  void Note(int32_t corner) {
    int32_t& tip = Valence(corner);
    int32_t& next = Valence(CornerTable::Next(corner));
    int32_t& before = Valence(CornerTable::Previous(corner));
    const int32_t ahead = std::clamp(next, kMinValence, kMaxValence) - kMinValence;
    if (previous >= 0) walk.context_symbols_[ahead].push_back(static_cast<uint32_t>(previous));
    previous = kSymbol;
    // The number of edges that each corner's vertex loses: those to neighbours that are still to do
    // stay.
    constexpr std::array<int8_t, 5> kOfTip = {0, 0, 1, 1, 2};
    constexpr std::array<int8_t, 5> kOfNext = {1, 1, 2, 1, 2};
    constexpr std::array<int8_t, 5> kOfPrevious = {1, 1, 1, 2, 2};
    tip -= kOfTip[kSymbol];
    next -= kOfNext[kSymbol];
    before -= kOfPrevious[kSymbol];
    if constexpr (kSymbol == kS) SplitTip(corner);
  }

 private:
  int32_t& Valence(int32_t corner) {
    const uint8_t state = walk.triangle_state_[CornerTable::TriangleOf(corner)];
    const bool is_other = (state & (kOtherVertex << (corner & 3))) != 0;
    return walk.valences_[is_other ? walk.split_vertex_[corner] : table.VertexOf(corner)];
  }
  bool IsToDo(int32_t corner) const { return !walk.IsDone(CornerTable::TriangleOf(corner)); }

  // Splits the tip: it keeps the triangles on the left that are still to do, those on the right get
  // a new vertex.
  void SplitTip(int32_t corner) {
    int32_t num_left = 0;
    for (int32_t c = table.LeftOf(corner); IsToDo(c); c = table.RightOf(c)) ++num_left;
    Valence(corner) = num_left + 1;
    const auto new_vertex = static_cast<int32_t>(walk.valences_.size());
    int32_t num_right = 0;
    for (int32_t c = table.RightOf(corner); IsToDo(c); c = table.LeftOf(c)) {
      ++num_right;
      const int32_t split = CornerTable::Next(c);
      walk.split_vertex_[split] = new_vertex;
      walk.triangle_state_[CornerTable::TriangleOf(split)] |=
          static_cast<uint8_t>(kOtherVertex << (split & 3));
    }
    walk.valences_.push_back(num_right + 1);
  }
};

bool Edgebreaker::Put(const CornerTable& table, EdgebreakerMethod method, SymbolCoder& coder,
                      std::string& out) {
  const bool has_contexts = method == EdgebreakerMethod::kValence;
  Reset(table);
  if (has_contexts) ResetContexts(table);
  const bool is_walked =
      has_contexts ? WalkAll(table, ValenceContexts{*this, table}) : WalkAll(table, NoContexts{});
  if (!is_walked) return false;
  PutByte(static_cast<uint8_t>(method), out);
  PutVarint(static_cast<uint32_t>(table.num_used_vertices()), out);
  PutVarint(static_cast<uint32_t>(table.num_triangles()), out);
  PutByte(0, out);  // attributes with connectivity of their own
  PutVarint(static_cast<uint32_t>(num_symbols_), out);
  PutVarint(static_cast<uint32_t>(num_splits_), out);
  PutReunions(out);
  if (!has_contexts) PutSymbols(out);
  PutOnes(static_cast<int>(last_corners_.size()), out);  // each component starts in its inside
  return !has_contexts || PutContexts(coder, out);
}

void Edgebreaker::Reset(const CornerTable& table) {
  symbols_.resize(table.num_triangles());
  split_symbol_.resize(table.num_triangles());
  triangle_state_.assign(table.num_triangles(), 0);
  is_vertex_done_.assign(table.num_vertices(), 0);
  last_corners_.clear();
  reunions_.clear();
  num_symbols_ = 0;
  num_splits_ = 0;
}

void Edgebreaker::ResetContexts(const CornerTable& table) {
  valences_ = table.valences();
  const size_t num_corners = 4 * static_cast<size_t>(table.num_triangles());
  if (split_vertex_.size() < num_corners) split_vertex_.resize(num_corners);
  for (std::vector<uint32_t>& symbols : context_symbols_) symbols.clear();
}

// Walks over all components. The first triangle of each has no symbol: the decoder adds it last.
template <typename Contexts>
bool Edgebreaker::WalkAll(const CornerTable& table, Contexts contexts) {
  for (int32_t t = 0; t < table.num_triangles(); ++t) {
    if (IsDone(t)) continue;
    const int32_t corner = 4 * t;
    triangle_state_[t] = kDone;
    for (int k = 0; k < 3; ++k) is_vertex_done_[table.VertexOf(corner + k)] = 1;
    const int32_t first = table.RightOf(corner);
    if (CornerTable::TriangleOf(table.RightOf(first)) == t &&
        CornerTable::TriangleOf(table.LeftOf(first)) == t) {
      return false;
    }
    last_corners_.push_back(Walk(table, first, contexts));
  }
  return true;
}

template <typename Contexts>
int32_t Edgebreaker::Walk(const CornerTable& table, int32_t corner, Contexts& contexts) {
  int32_t last = corner;
  stack_.assign(1, corner);
  while (!stack_.empty()) {
    corner = stack_.back();
    if (IsDone(CornerTable::TriangleOf(corner))) {
      stack_.pop_back();
      continue;
    }
    while (corner != kNone) {
      last = corner;
      corner = Step(table, corner, contexts);
    }
  }
  return last;
}

// Codes the corner's triangle. Returns the corner to continue from, or kNone: then the next one is
// on the stack.
template <typename Contexts>
int32_t Edgebreaker::Step(const CornerTable& table, int32_t corner, Contexts& contexts) {
  const int32_t triangle = CornerTable::TriangleOf(corner);
  triangle_state_[triangle] |= kDone;
  const int32_t right = table.RightOf(corner);
  const int32_t left = table.LeftOf(corner);
  table.Prefetch(right);
  table.Prefetch(left);
  uint8_t& is_tip_done = is_vertex_done_[table.VertexOf(corner)];
  if (is_tip_done == 0) {
    is_tip_done = 1;
    Add<kC>(corner, contexts);
    return right;
  }
  const bool is_right_done = IsDone(CornerTable::TriangleOf(right));
  const bool is_left_done = IsDone(CornerTable::TriangleOf(left));
  if (is_right_done) NoteReunion(right, /*is_on_right=*/true);
  if (is_left_done) NoteReunion(left, /*is_on_right=*/false);
  if (!is_right_done && is_left_done) {
    Add<kL>(corner, contexts);
    return right;
  }
  if (is_right_done && !is_left_done) {
    Add<kR>(corner, contexts);
    return left;
  }
  if (is_right_done) {
    Add<kE>(corner, contexts);
    stack_.pop_back();
    return kNone;
  }
  triangle_state_[triangle] |= kSplit;
  split_symbol_[triangle] = num_symbols_;
  ++num_splits_;
  Add<kS>(corner, contexts);
  stack_.back() = left;
  stack_.push_back(right);
  return kNone;
}

template <uint8_t kSymbol, typename Contexts>
void Edgebreaker::Add(int32_t corner, Contexts& contexts) {
  contexts.template Note<kSymbol>(corner);
  symbols_[num_symbols_++] = kSymbol;
}

void Edgebreaker::NoteReunion(int32_t neighbor, bool is_on_right) {
  const int32_t triangle = CornerTable::TriangleOf(neighbor);
  if ((triangle_state_[triangle] & kSplit) == 0) return;
  reunions_.push_back({num_symbols_, split_symbol_[triangle], is_on_right});
}

void Edgebreaker::PutReunions(std::string& out) const {
  PutVarint(reunions_.size(), out);
  int32_t before = 0;
  for (const Reunion& reunion : reunions_) {
    PutVarint(static_cast<uint32_t>(reunion.symbol - before), out);
    PutVarint(static_cast<uint32_t>(reunion.symbol - reunion.split_symbol), out);
    before = reunion.symbol;
  }
  BitPacker packer(out);
  for (const Reunion& reunion : reunions_) packer.Put(reunion.is_on_right ? 1 : 0, 1);
  packer.Finish();
}

void Edgebreaker::PutSymbols(std::string& out) const {
  const uint8_t* const first = symbols_.data();
  const auto num_c = std::count(first, first + num_symbols_, kC);
  const int64_t num_bits = 3 * int64_t{num_symbols_} - 2 * num_c;
  PutVarint(static_cast<uint64_t>((num_bits + 7) / 8), out);
  BitPacker packer(out);
  for (int32_t s = num_symbols_ - 1; s >= 0; --s) {
    const Pattern pattern = kPatterns[first[s]];
    packer.Put(pattern.bits, pattern.num_bits);
  }
  packer.Finish();
}

bool Edgebreaker::PutContexts(SymbolCoder& coder, std::string& out) const {
  for (const std::vector<uint32_t>& symbols : context_symbols_) {
    PutVarint(symbols.size(), out);
    if (!symbols.empty() && !coder.Put(symbols, {}, out)) return false;
  }
  return true;
}

}  // namespace liquidblend::encode
