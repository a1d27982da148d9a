// How much of a surface is inside out, as one sees it.
#pragma once

#include <cstdint>

#include "core/mesh/triangle_mesh.h"

namespace liquidblend::synthetic {

struct CrossingCount {
  int64_t num_crossings = 0;
  int64_t num_inverted = 0;  // those with a winding number below 0 on one of their sides
  double inverted_share() const {
    const auto count = static_cast<double>(num_crossings);
    return num_crossings == 0 ? 0.0 : static_cast<double>(num_inverted) / count;
  }
  CrossingCount& operator+=(const CrossingCount& other) {
    num_crossings += other.num_crossings;
    num_inverted += other.num_inverted;
    return *this;
  }
};

// Rays along x and along z through a closed surface, one every spacing_m both ways across. Parts
// that overlap wind twice and are no fault, nor are bubbles.
// Requires: spacing_m > 0.
CrossingCount CountInverted(const mesh::TriangleMesh& surface, double spacing_m);

}  // namespace liquidblend::synthetic
