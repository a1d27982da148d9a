// The direction that is up, found from liquid that falls.
#pragma once

#include <string>

#include "core/mesh/animation.h"
#include "core/parallel/arena.h"

namespace liquidblend::ingest {

struct FoundUp {
  mesh::Up up = mesh::Up::kUnknown;  // kUnknown: nothing shows it clearly
  int num_samples = 0;  // accelerations of parts, each over three frames, that it was found from
};

// Looks at detached parts that keep their volume over three frames, other than the main body, and
// takes the median of their accelerations: from velocities where there are some, else from their
// centres. It is clear if at least eight accelerations were measured, two thirds of them lie near
// the median, and the median is within 20 degrees of an axis and not noise.
// Threads: safe, same result for any thread count.  Cost: O(vertices + triangles).
FoundUp FindUp(const mesh::Animation& animation, const parallel::Arena& arena);

// Sets animation.up to what was found unless it is known already, and adds a note about what was
// found or assumed, or about falling parts that contradict what was given.
void SettleUp(mesh::Animation& animation, const parallel::Arena& arena);

}  // namespace liquidblend::ingest
