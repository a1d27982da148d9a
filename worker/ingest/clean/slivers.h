// Removes zero-area triangles and slivers without opening the surface.
#pragma once

#include <cstdint>

#include "core/mesh/triangle_mesh.h"
#include "worker/ingest/clean/check.h"

namespace liquidblend::ingest {

// A triangle is a sliver if its height over its longest side is at most this share of that side.
inline constexpr double kSliverShare = 0.01;
// A side up to this share of the sliver's longest side may be collapsed.
inline constexpr double kShortSideShare = 0.02;

struct SliverCounts {
  int64_t num_removed = 0;  // slivers that are gone
  int64_t num_left = 0;     // slivers that could not go without changing the topology
  int64_t num_specks = 0;   // parts without extent or volume that are gone, whole
};

// Collapses the short side of a needle onto one of its ends, flips the long side of a cap, and
// takes out vertices of three triangles that lie in their plane. No vertex moves, none is added;
// the surface stays within kShortSideShare of the sliver's longest side at each step. Parts that
// are two triangles back to back, or smaller than a thousandth of the mean edge, are dropped. The
// result is a closed, oriented manifold; vertices that are no longer used stay. Requires:
// neighbours of this mesh, no vertex pinched. Cost: O(triangles), a few passes.
SliverCounts RemoveSlivers(Neighbours neighbours, mesh::TriangleMesh& mesh);

}  // namespace liquidblend::ingest
