// Draco bytes -> Mesh.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "liquidblend/mesh.h"

namespace liquidblend {

// Decodes one Draco mesh, for example Frame::data, with normals and velocities (a generic attribute
// whose metadata entry "name" is "velocity") if it has them. Vertices are in the order of the
// stream; only parts that the encoder had to take apart at non-manifold edges are joined again
// along their open edges, so a closed mesh stays closed. Errors: kInvalidArgument if the bytes are
// not a Draco mesh with positions; kDataLoss if they are damaged.  Threads: safe.  Cost: about 10
// ms per 100,000 triangles.
absl::StatusOr<Mesh> DecodeMesh(const std::string& draco_bytes);

}  // namespace liquidblend
