// Inner loops of slicing, with the widest vector instructions of the machine.
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace liquidblend::slice {

// A bit per vertex of a cluster.
struct alignas(16) VertexBits : std::array<uint8_t, 16> {};

// A bit per edge of a cluster.
using EdgeBits = std::array<uint64_t, 4>;

// Term of a vertex's time, added to the source's time: factor times a field of numbers, one per
// vertex.
struct TimeTerm {
  float factor = 0.0F;
  int field = 0;  // 0 is the source's times
};

// Number of bytes that the kernels may read beyond the end of their input, and write beyond the end
// of `codes`.
inline constexpr int kKernelOverrun = 64;

// Finds the vertices at or after a time: sets bit v where times[v] + sum of factor * times[field *
// num_vertices + v] >= first_later. The sum is added up in the terms' order without fused
// multiply-add, so that a blend of whole positions decides the same.  Requires: num_vertices <=
// 128.
void FindLater(const float* times, int num_vertices, std::span<const TimeTerm> terms,
               float first_later, VertexBits& later);

// Sets codes[c]: bit k is that of corners[k * num_cells + c]. Returns the set of the cells that are
// cut, those whose bits differ.  Requires: corners < 128; num_corners <= 8, num_cells <= 64.
uint64_t FindCodes(const VertexBits& later, const uint8_t* corners, int num_corners, int num_cells,
                   uint8_t* codes);

// Finds the crossed edges: sets bit e where the bits of low_ends[e] and high_ends[e] differ, and
// none beyond num_edges. Requires: ends < 128; num_edges <= 256.
void FindCrossed(const VertexBits& later, const uint8_t* low_ends, const uint8_t* high_ends,
                 int num_edges, EdgeBits& crossed);

}  // namespace liquidblend::slice
