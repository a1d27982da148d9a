// A triangle surface as a MeshoptMesh (liquidblend.proto): larger than Draco, many times faster to
// decode.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/frames/rounded_surface.h"
#include "core/mesh/triangle_mesh.h"

namespace liquidblend::encode {

// Errors: kInvalidArgument (options, naming the field; indices out of range or numbers not finite,
// naming the element). Threads: safe, same bytes always.
absl::StatusOr<std::string> EncodeMeshopt(const mesh::TriangleMesh& mesh,
                                          const frames::RoundingOptions& options);

}  // namespace liquidblend::encode
