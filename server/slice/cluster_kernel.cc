#include "server/slice/cluster_kernel.h"

#include <algorithm>

// Highway compiles this file once per kind of machine.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/slice/cluster_kernel.cc"
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
      const auto field = hn::LoadU(d, times + terms[k].field * num_vertices + v);
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
void FindCodes(const uint8_t* later, const uint8_t* corners, int num_corners, int num_cells,
               uint8_t* codes) {
  for (int c = 0; c < num_cells; ++c) {
    unsigned code = 0;
    for (int k = 0; k < num_corners; ++k) {
      const uint8_t corner = corners[k * num_cells + c];
      code |= (later[corner / 8] >> corner % 8 & 1U) << k;
    }
    codes[c] = static_cast<uint8_t>(code);
  }
}
#else
void FindCodes(const uint8_t* later, const uint8_t* corners, int num_corners, int num_cells,
               uint8_t* codes) {
  const hn::CappedTag<uint8_t, kKernelOverrun> d;
  alignas(16) static constexpr uint8_t kBits[16] = {1, 2, 4, 8, 16, 32, 64, 128,
                                                    1, 2, 4, 8, 16, 32, 64, 128};
  const auto bytes = hn::LoadDup128(d, later);
  const auto bits = hn::LoadDup128(d, kBits);
  const auto lanes = static_cast<int>(hn::Lanes(d));
  for (int c = 0; c < num_cells; c += lanes) {
    auto code = hn::Zero(d);
    for (int k = 0; k < num_corners; ++k) {
      const auto corner = hn::LoadU(d, corners + k * num_cells + c);
      const auto byte = hn::And(hn::ShiftRight<3>(corner), hn::Set(d, uint8_t{15}));
      const auto bit = hn::TableLookupBytes(bits, hn::And(corner, hn::Set(d, uint8_t{7})));
      const auto is_later = hn::TestBit(hn::TableLookupBytes(bytes, byte), bit);
      code = hn::Or(code, hn::IfThenElseZero(is_later, hn::Set(d, static_cast<uint8_t>(1 << k))));
    }
    hn::StoreU(code, d, codes + c);
  }
}
#endif

}  // namespace liquidblend::slice::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace liquidblend::slice {

HWY_EXPORT(FindLater);
HWY_EXPORT(FindCodes);

void FindLater(const float* times, int num_vertices, std::span<const TimeTerm> terms,
               float first_later, VertexBits& later) {
  later.fill(0);
  HWY_DYNAMIC_DISPATCH(FindLater)
  (times, num_vertices, terms.data(), terms.size(), first_later, later.data());
  // The last vectors went beyond the cluster.
  for (int v = num_vertices; v % 8 != 0; ++v) {
    later[v / 8] = static_cast<uint8_t>(later[v / 8] & ~(1U << v % 8));
  }
  std::fill(later.begin() + (num_vertices + 7) / 8, later.end(), uint8_t{0});
}

void FindCodes(const VertexBits& later, const uint8_t* corners, int num_corners, int num_cells,
               uint8_t* codes) {
  HWY_DYNAMIC_DISPATCH(FindCodes)(later.data(), corners, num_corners, num_cells, codes);
}

}  // namespace liquidblend::slice
#endif  // HWY_ONCE
