#include "worker/spacetime/nets/cell_sheets.h"

#include <bit>
#include <vector>

namespace liquidblend::spacetime {
namespace {

constexpr int kNumFaces = 24;
// Per face: its corners in the order 00, 10, 01, 11 of its two axes, and its edges between corners
// 0 1, 2 3 (first axis), 0 2, 1 3 (second axis).
struct Face {
  std::array<int8_t, 4> corner;
  std::array<int8_t, 4> edge;
};

std::array<Face, kNumFaces> MakeFaces() {
  std::array<Face, kNumFaces> faces{};
  int n = 0;
  for (int a = 0; a < 4; ++a) {
    for (int b = a + 1; b < 4; ++b) {
      for (int base = 0; base < 16; ++base) {
        if ((base >> a & 1) != 0 || (base >> b & 1) != 0) continue;
        Face& face = faces[n++];
        for (int c = 0; c < 4; ++c) {
          face.corner[c] = static_cast<int8_t>(base | (c & 1) << a | (c >> 1) << b);
        }
        face.edge = {static_cast<int8_t>(CellEdge(a, face.corner[0])),
                     static_cast<int8_t>(CellEdge(a, face.corner[2])),
                     static_cast<int8_t>(CellEdge(b, face.corner[0])),
                     static_cast<int8_t>(CellEdge(b, face.corner[1]))};
      }
    }
  }
  return faces;
}

using Links = std::array<uint32_t, kNumCellEdges>;  // per edge: those it is connected to

void Link(int a, int b, Links& links) {
  links[a] |= uint32_t{1} << b;
  links[b] |= uint32_t{1} << a;
}

Links LinkEdges(uint16_t inside, uint32_t crossed) {
  static const std::array<Face, kNumFaces> kFaces = MakeFaces();
  Links links{};
  for (const Face& face : kFaces) {
    std::array<int, 4> on_face{};
    int count = 0;
    for (const int edge : face.edge) {
      if ((crossed >> edge & 1) != 0) on_face[count++] = edge;
    }
    if (count == 2) Link(on_face[0], on_face[1], links);
    if (count != 4) continue;
    const bool diagonal = (inside >> face.corner[0] & 1) != 0;  // corners 0 and 3 are inside
    Link(face.edge[0], face.edge[diagonal ? 2 : 3], links);
    Link(face.edge[1], face.edge[diagonal ? 3 : 2], links);
  }
  return links;
}

}  // namespace

uint32_t CrossedEdges(uint16_t inside) {
  const uint32_t bits = inside;
  // Along each axis the ends that differ, at the lower ones, whose numbers then close up.
  uint32_t x = (bits ^ bits >> 1) & 0x5555, y = (bits ^ bits >> 2) & 0x3333;
  x = (x | x >> 1) & 0x3333;
  x = (x | x >> 2) & 0x0f0f;
  y = (y | y >> 2) & 0x0f0f;
  const uint32_t z = (bits ^ bits >> 4) & 0x0f0f, t = (bits ^ bits >> 8) & 0xff;
  const auto halves = [](uint32_t low_nibbles) { return (low_nibbles | low_nibbles >> 4) & 0xff; };
  return halves(x) | halves(y) << 8 | halves(z) << 16 | t << 24;
}

CellSheets FindSheets(uint16_t inside) {
  CellSheets sheets;
  sheets.sheet_of.fill(-1);
  uint32_t left = CrossedEdges(inside);
  const Links links = LinkEdges(inside, left);
  while (left != 0) {
    uint32_t sheet = 0, front = left & (~left + 1);
    while (front != 0) {
      const int edge = std::countr_zero(front);
      sheet |= uint32_t{1} << edge;
      sheets.sheet_of[edge] = static_cast<int8_t>(sheets.count);
      front = (front | links[edge]) & ~sheet;
    }
    left &= ~sheet;
    sheets.edges[sheets.count++] = sheet;
  }
  return sheets;
}

int NumSheets(uint16_t inside) {
  static const std::vector<uint8_t> kCounts = [] {
    std::vector<uint8_t> counts(1 << 16);
    for (int bits = 0; bits < 1 << 16; ++bits) {
      counts[bits] = static_cast<uint8_t>(FindSheets(static_cast<uint16_t>(bits)).count);
    }
    return counts;
  }();
  return kCounts[inside];
}

}  // namespace liquidblend::spacetime
