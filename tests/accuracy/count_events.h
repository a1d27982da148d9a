// Craters and jets of a surface, counted. A blend that cross-fades the craters of two animations
// has two where each of them has one.
#pragma once

#include "core/mesh/up.h"
#include "tests/accuracy/measure.h"

namespace liquidblend::accuracy {

// The most craters and jets that are there at once in an early frame. A crater is a connected
// region that is at least half as far below the median height as the deepest point of all these
// frames, a jet one that is as far above it. Detached drops are not seen, nor is what lies within
// two edges of the liquid's box. None of less than two edges in height.
struct EventCounts {
  int craters = 0;
  int jets = 0;
};
EventCounts CountEvents(const SurfaceAt& surface, const Frames& frames, mesh::Up up,
                        double edge_length_m, const parallel::Arena& arena);

}  // namespace liquidblend::accuracy
