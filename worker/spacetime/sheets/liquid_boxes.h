// The liquid next to thin sheets as boxes around grid points. Internal to worker/spacetime.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "core/parallel/arena.h"
#include "worker/spacetime/nets/layers.h"

namespace liquidblend::spacetime {

// A corner of a box: a vertex of a slab, or the middle of a cell without one.
struct BoxCorner {
  int slab = 0;
  int32_t vertex = -1;                              // -1: none
  Eigen::Vector4f place = Eigen::Vector4f::Zero();  // if none: grid units and frames
};

// Around each grid point that is inside at a layer lies a box whose corners are the vertices of the
// cells around the point, before and after the layer. The liquid is the sum of all boxes; these are
// the faces that bound the boxes of some points of one layer.
struct BoxFaces {
  int layer = 0;                          // of all
  std::vector<BoxCorner> before, after;   // per corner
  std::vector<std::array<int, 4>> faces;  // corners, counter-clockwise seen from outside
};

// The faces for the points next to vertices outside of their cells (Slab::beyond), and for the
// points around these; one entry per layer that has any, ascending.
// Threads: same bytes for any thread count.
std::vector<BoxFaces> FindBoxFaces(const Layers& layers, const parallel::Arena& arena);

}  // namespace liquidblend::spacetime
