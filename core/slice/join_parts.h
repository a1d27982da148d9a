// Parts of a slice -> the slice.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "absl/functional/function_ref.h"
#include "core/mesh/triangle_mesh.h"
#include "core/slice/surface_part.h"

namespace liquidblend::slice {

// Joins the parts' surfaces in their order, as if they had been made as one: outer vertices become
// those of the earlier part, so the result does not depend on where the parts begin.
//   clusters                 per cluster: its vertices in its part
//   near_vertex, far_vertex  out: per vertex of the result
//   for_each               calls a function once for each part's number, in any order, on any
//   thread
mesh::TriangleMesh JoinParts(std::span<SurfacePart> parts,
                             std::span<const ClusterVertices> clusters,
                             absl::FunctionRef<void(absl::FunctionRef<void(int)>)> for_each,
                             std::vector<int32_t>& near_vertex, std::vector<int32_t>& far_vertex);

}  // namespace liquidblend::slice
