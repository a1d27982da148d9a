// Draco meshes as clients see them.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/mesh/triangle_mesh.h"
#include "server/encode/draco.h"

namespace liquidblend::encode {

// A grid around the origin, 4 m wide.
DracoOptions OptionsWith(int position_bits);

// Metres from one node of the grid to the next.
double StepOf(const DracoOptions& options);

// By libdraco. A failure of the test, and an empty mesh, if it refuses the bytes.
mesh::TriangleMesh Decode(const std::string& data);

// The nodes of the grid that the triangles' corners are rounded to: each triangle from its lowest
// corner on, all in order. The same for two meshes exactly if they are the same surface.
std::vector<std::array<int64_t, 9>> NodesOf(const mesh::TriangleMesh& mesh,
                                            const DracoOptions& options);

}  // namespace liquidblend::encode
