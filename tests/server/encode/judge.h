// Draco meshes as clients see them.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/mesh/triangle_mesh.h"
#include "server/encode/draco.h"

namespace liquidblend::encode {

// Metres from one node of the grid to the next.
double StepOf(const DracoOptions& options);

// By libdraco.  Errors: kDataLoss if it refuses the bytes or finds attributes that are not ours.
absl::StatusOr<mesh::TriangleMesh> TryDecode(const std::string& data);

// The nodes of the grid that the triangles' corners are rounded to: each triangle from its lowest
// corner on, all in order. The same for two meshes exactly if they are the same surface.
std::vector<std::array<int64_t, 9>> NodesOf(const mesh::TriangleMesh& mesh,
                                            const DracoOptions& options);

}  // namespace liquidblend::encode
