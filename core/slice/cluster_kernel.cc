#include "core/slice/cluster_kernel.h"

#include <algorithm>

// Highway compiles this file once per kind of machine.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/slice/cluster_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace liquidblend::slice::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

void FindLater(const float* times, int num_vertices, const TimeTerm* terms, size_t num_terms,
               float first_later, uint8_t* later) {
  const hn::CappedTag<float, 16> d;
  const auto lanes = static_cast<int>(hn::Lanes(d));
  const auto first = hn::Set(d, first_later);
  for (int v = 0; v < num_vertices; v += lanes) {
    auto sum = hn::LoadU(d, times + v);
    for (size_t k = 0; k < num_terms; ++k) {
      const auto field = hn::LoadU(d, times + terms[k].field * ptrdiff_t{num_vertices} + v);
      sum = hn::Add(sum, hn::Mul(hn::Set(d, terms[k].factor), field));
    }
    uint8_t bits[8] = {};
    const size_t num_bytes = hn::StoreMaskBits(d, hn::Ge(sum, first), bits);
    if (lanes < 8) {
      later[v / 8] = static_cast<uint8_t>(later[v / 8] | bits[0] << v % 8);
    } else {
      std::copy_n(bits, num_bytes, later + v / 8);
    }
  }
}

#if HWY_TARGET == HWY_SCALAR  // has no vectors to look bytes up in
bool IsLater(const uint8_t* later, uint8_t v) { return (later[v / 8] >> v % 8 & 1U) != 0; }

uint64_t FindCodes(const uint8_t* later, const uint8_t* corners, int num_corners, int num_cells,
                   uint8_t* codes) {
  uint64_t cut = 0;
  for (int c = 0; c < num_cells; ++c) {
    unsigned code = 0;
    for (int k = 0; k < num_corners; ++k) {
      code |= static_cast<unsigned>(IsLater(later, corners[k * num_cells + c])) << k;
    }
    codes[c] = static_cast<uint8_t>(code);
    const bool is_cut = code != 0 && code != (1U << num_corners) - 1;
    cut |= static_cast<uint64_t>(is_cut) << c;
  }
  return cut;
}

void FindCrossed(const uint8_t* later, const uint8_t* low_ends, const uint8_t* high_ends,
                 int num_edges, uint64_t* crossed) {
  for (int e = 0; e < num_edges; ++e) {
    const bool is_crossed = IsLater(later, low_ends[e]) != IsLater(later, high_ends[e]);
    crossed[e / 64] |= static_cast<uint64_t>(is_crossed) << e % 64;
  }
}
#else
// Looks up the bits of vertices, a vector at a time.
class LaterBits {
 public:
  using Tag = hn::CappedTag<uint8_t, kKernelOverrun>;
  using Bytes = hn::Vec<Tag>;

  explicit LaterBits(const uint8_t* later)
      : bytes_(hn::LoadDup128(Tag(), later)), bits_(hn::LoadDup128(Tag(), kBits)) {}

  // The bits of vertices[0] and of those after it.
  hn::Mask<Tag> Of(const uint8_t* vertices) const {
    const Tag d;
    const auto vertex = hn::LoadU(d, vertices);
    const auto byte = hn::And(hn::ShiftRight<3>(vertex), hn::Set(d, uint8_t{15}));
    const auto bit = hn::TableLookupBytes(bits_, hn::And(vertex, hn::Set(d, uint8_t{7})));
    return hn::TestBit(hn::TableLookupBytes(bytes_, byte), bit);
  }

 private:
  alignas(16) static constexpr uint8_t kBits[16] = {1, 2, 4, 8, 16, 32, 64, 128,
                                                    1, 2, 4, 8, 16, 32, 64, 128};
  Bytes bytes_;
  Bytes bits_;
};

// Adds a vector's bits to a set, from bit `first` on.
void AddBits(hn::Mask<LaterBits::Tag> mask, int first, uint64_t* set) {
  uint64_t bits = 0;
  hn::StoreMaskBits(LaterBits::Tag(), mask, reinterpret_cast<uint8_t*>(&bits));
  set[first / 64] |= bits << first % 64;
}

uint64_t FindCodes(const uint8_t* later, const uint8_t* corners, int num_corners, int num_cells,
                   uint8_t* codes) {
  const LaterBits::Tag d;
  const LaterBits is_later(later);
  const auto lanes = static_cast<int>(hn::Lanes(d));
  const auto all = hn::Set(d, static_cast<uint8_t>((1U << num_corners) - 1));
  uint64_t cut = 0;
  for (int c = 0; c < num_cells; c += lanes) {
    auto code = hn::Zero(d);
    for (int k = 0; k < num_corners; ++k) {
      const auto bit = hn::Set(d, static_cast<uint8_t>(1U << k));
      code = hn::Or(code,
                    hn::IfThenElseZero(is_later.Of(corners + ptrdiff_t{k} * num_cells + c), bit));
    }
    hn::StoreU(code, d, codes + c);
    AddBits(hn::And(hn::Ne(code, hn::Zero(d)), hn::Ne(code, all)), c, &cut);
  }
  return cut;
}

void FindCrossed(const uint8_t* later, const uint8_t* low_ends, const uint8_t* high_ends,
                 int num_edges, uint64_t* crossed) {
  const LaterBits is_later(later);
  const auto lanes = static_cast<int>(hn::Lanes(LaterBits::Tag()));
  for (int e = 0; e < num_edges; e += lanes) {
    AddBits(hn::Xor(is_later.Of(low_ends + e), is_later.Of(high_ends + e)), e, crossed);
  }
}
#endif

}  // namespace liquidblend::slice::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace liquidblend::slice {

namespace {

// Requires: 0 < count <= 64.
uint64_t FirstBits(int count) { return ~uint64_t{0} >> (64 - count); }

}  // namespace

HWY_EXPORT(FindLater);
HWY_EXPORT(FindCodes);
HWY_EXPORT(FindCrossed);

void FindLater(const float* times, int num_vertices, std::span<const TimeTerm> terms,
               float first_later, VertexBits& later) {
  later.fill(0);
  HWY_DYNAMIC_DISPATCH(FindLater)
  (times, num_vertices, terms.data(), terms.size(), first_later, later.data());
  // Clears bits beyond the cluster, which the last vectors set.
  for (int v = num_vertices; v % 8 != 0; ++v) {
    later[v / 8] = static_cast<uint8_t>(later[v / 8] & ~(1U << v % 8));
  }
  std::fill(later.begin() + (num_vertices + 7) / 8, later.end(), uint8_t{0});
}

uint64_t FindCodes(const VertexBits& later, const uint8_t* corners, int num_corners, int num_cells,
                   uint8_t* codes) {
  const uint64_t cut =
      HWY_DYNAMIC_DISPATCH(FindCodes)(later.data(), corners, num_corners, num_cells, codes);
  return cut & FirstBits(num_cells);  // the last vector went beyond the cluster
}

void FindCrossed(const VertexBits& later, const uint8_t* low_ends, const uint8_t* high_ends,
                 int num_edges, EdgeBits& crossed) {
  crossed.fill(0);
  HWY_DYNAMIC_DISPATCH(FindCrossed)(later.data(), low_ends, high_ends, num_edges, crossed.data());
  if (num_edges % 64 != 0) crossed[num_edges / 64] &= FirstBits(num_edges % 64);
}

}  // namespace liquidblend::slice
#endif  // HWY_ONCE
