// Bytes of a frame -> Mesh.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "liquidblend/mesh.h"

namespace liquidblend {

// Decodes one mesh of either FrameFormat, for example Frame::data, with normals, velocities and
// rest positions if it has them (of Draco: generic attributes whose metadata entry "name" is
// "velocity" or "rest"). Vertices are in the order of the stream. Only parts that Draco's encoder
// had to take apart at non-manifold edges are joined again along their open edges, so a closed mesh
// stays closed. Errors: kInvalidArgument if the bytes are neither a Draco mesh (bitstream 2.2) with
// positions nor a MeshoptMesh; kDataLoss if they are damaged, have a number that is not finite,
// have one of these attributes of another type than float, or claim more triangles or vertices than
// a frame of their size has.  Threads: safe.  Cost: about 10 ms per 100,000 triangles of Draco.
absl::StatusOr<Mesh> DecodeMesh(const std::string& bytes);

}  // namespace liquidblend
