// Polygon: a loop of crossings that is cut into triangles, ear by ear.
#pragma once

#include <array>
#include <cstdint>

#include "core/mesh/marching_table.h"

namespace liquidblend::slice {

// Polygon in arrays of fixed size, as there are thousands of polygons in a slice.
struct Polygon {
  struct Corner {
    uint8_t crossing;
    uint16_t edge;   // bit set of the cell's edges that it lies on: one, or two that coincide
    uint16_t mates;  // of those that share a facet with it
  };
  std::array<Corner, mesh::kMaxEdges + 2> corners;  // see Close()
  int size = 0;

  // Adds a corner at the end.
  void Add(const Corner& corner) { corners[size++] = corner; }

  // Merges a corner with the equal one before it.
  void Merge(const Corner& corner) {
    if (size == 0 || corners[size - 1].crossing != corner.crossing) return Add(corner);
    corners[size - 1].edge |= corner.edge;
    corners[size - 1].mates |= corner.mates;
  }

  // Merges the last corner with the first one if they are equal.
  void MergeEnds() {
    if (size < 2 || corners[0].crossing != corners[size - 1].crossing) return;
    corners[0].edge |= corners[size - 1].edge;
    corners[0].mates |= corners[size - 1].mates;
    --size;
  }

  // Repeats the first two corners after the last one, so that base k is from corner k to corner k +
  // 2.
  void Close() {
    corners[size] = corners[0];
    corners[size + 1] = corners[1];
  }

  // Removes a corner; the later ones move up.
  void Remove(int corner) {
    --size;
    for (int k = corner; k < size; ++k) corners[k] = corners[k + 1];
  }
};

}  // namespace liquidblend::slice
