// Upward direction of an animation, found from falling liquid.
#pragma once

#include <string>

#include "core/mesh/animation.h"
#include "core/parallel/arena.h"

namespace liquidblend::ingest {

struct FoundUp {
  mesh::Up up = mesh::Up::kUnknown;  // kUnknown: no clear result
  int num_samples = 0;               // measured accelerations of parts, each over three frames
};

// Takes the median acceleration of detached parts, other than the main body, that keep their volume
// over three frames: from velocities where there are some, else from their centres. The result is
// clear if at least eight accelerations were measured, two thirds of them lie near the median, and
// the median is within 20 degrees of an axis and not noise.
// Threads: safe, same result for any thread count.  Cost: O(vertices + triangles).
FoundUp FindUp(const mesh::Animation& animation, const parallel::Arena& arena);

// Sets animation.up to the direction that was found, unless it is known already. Adds a note about
// the direction that was found or assumed, or about falling parts that contradict the given one.
void SettleUp(mesh::Animation& animation, const parallel::Arena& arena);

}  // namespace liquidblend::ingest
