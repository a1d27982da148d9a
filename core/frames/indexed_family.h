// Registered family with the indices that frames are made with.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "core/blend/life_limits.h"
#include "core/finish/time_links.h"
#include "core/frames/grid.h"
#include "core/mesh/registered_family.h"
#include "core/parameters/interpolator.h"
#include "core/slice/cell_index.h"

namespace liquidblend::frames {

// One level of detail with its indices.  Threads: safe, immutable.
struct IndexedLevel {
  explicit IndexedLevel(const mesh::RegisteredFamily& level)
      : family(level), index(level), time_links(level) {}
  const mesh::RegisteredFamily& family;  // the IndexedFamily's own, or one of its coarser levels
  const slice::CellIndex index;
  const finish::TimeLinks time_links;
};

// A family's interpolation in parameter space; nothing if it has none.
using OptionalSpace = std::optional<const parameters::Interpolator>;

// The interpolation of `space`, or nothing if that is empty.
// Errors: those of parameters::Interpolator::Make().
absl::StatusOr<OptionalSpace> MakeOptionalSpace(const mesh::ParameterSpace& space);

// A family and the indices of its levels.  Threads: safe, immutable.
struct IndexedFamily {
  // Builds the indices.  Requires: registered passed Validate().  Cost: O(cells log cells).
  //   space  of registered.parameter_space
  IndexedFamily(mesh::RegisteredFamily registered, OptionalSpace space);
  IndexedFamily(const IndexedFamily&) = delete;
  IndexedFamily& operator=(const IndexedFamily&) = delete;

  const mesh::RegisteredFamily family;
  // By level of detail: `family`, then its coarser levels.
  const std::vector<std::unique_ptr<const IndexedLevel>> levels;
  const Grid grid;  // for every frame of `family` at any level
  const OptionalSpace parameter_space;
  const blend::LifeLimits life_limits;
  int64_t index_bytes() const;  // memory of all indices and links
};

}  // namespace liquidblend::frames
