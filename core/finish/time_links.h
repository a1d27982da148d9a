// Time links of a space-time mesh: the vertices of one place of the surface a little earlier and
// later.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/mesh/registered_family.h"

namespace liquidblend::finish {

// Links of vertices through time: the edges of hexahedra and wedges, one each way per vertex. The
// edge that moves least in the source is taken. Cells that are flat in time and cones have none.
// Threads: safe, immutable.
class TimeLinks {
 public:
  // Finds the links.  Requires: family passed Validate().  Cost: O(vertices + cells).
  explicit TimeLinks(const mesh::RegisteredFamily& family);

  // Per vertex of the family: the linked vertex, or -1.
  std::span<const int32_t> earlier() const { return earlier_; }
  std::span<const int32_t> later() const { return later_; }
  const mesh::TimeAxis& axis() const { return axis_; }  // of the family
  // Memory of the links.
  int64_t size_bytes() const;

 private:
  mesh::TimeAxis axis_;
  std::vector<int32_t> earlier_;
  std::vector<int32_t> later_;
};

}  // namespace liquidblend::finish
