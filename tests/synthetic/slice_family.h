// What the server cuts, unfinished: for tests and tools that want a surface in one call.
#pragma once

#include <cstdlib>
#include <iostream>
#include <span>

#include "core/blend/blend.h"
#include "core/mesh/triangle_mesh.h"
#include "core/slice/slice.h"

namespace liquidblend::synthetic {

// Requires: weights and time are the family's; ends the program otherwise.
inline mesh::TriangleMesh SliceFamily(const slice::CellIndex& index,
                                      std::span<const double> weights, double time_s,
                                      slice::Workspace& workspace) {
  const absl::Status found = slice::FindCandidates(index, weights, time_s, workspace);
  if (!found.ok()) {
    std::cerr << found << "\n";
    std::abort();
  }
  return slice::March(index, blend::Blender(index.family(), weights), workspace);
}

inline mesh::TriangleMesh SliceFamily(const slice::CellIndex& index,
                                      std::span<const double> weights, double time_s) {
  slice::Workspace workspace;
  return SliceFamily(index, weights, time_s, workspace);
}

}  // namespace liquidblend::synthetic
