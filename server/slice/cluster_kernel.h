// The inner loops of slicing, in the widest vectors that the machine has.
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace liquidblend::slice {

// A bit per vertex of a cluster.
struct alignas(16) VertexBits : std::array<uint8_t, 16> {};

// Added to the source's times: factor times a field of numbers, one per vertex.
struct TimeTerm {
  float factor = 0.0F;
  int field = 0;  // 0 is the source's times
};

// How far the kernels may read beyond the end of what they are given, and write beyond the end of
// `codes`, in bytes.
inline constexpr int kKernelOverrun = 64;

// Sets bit v where times[v] + sum of factor * times[field * num_vertices + v] >= first_later. Added
// up in the terms' order without fused multiply-add, so that a blend of whole positions decides the
// same.  Requires: num_vertices <= 128.
void FindLater(const float* times, int num_vertices, std::span<const TimeTerm> terms,
               float first_later, VertexBits& later);

// codes[c]: bit k is that of corners[k * num_cells + c].  Requires: corners < 128; num_corners
// <= 8.
void FindCodes(const VertexBits& later, const uint8_t* corners, int num_corners, int num_cells,
               uint8_t* codes);

}  // namespace liquidblend::slice
