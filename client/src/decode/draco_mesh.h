// A Draco mesh as it was encoded, and how its parts are joined. Internal to client/.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "liquidblend/mesh.h"

namespace liquidblend {

// A decoded mesh before WeldOpenEdges(), and the unique ids by which formats such as glTF name its
// attributes; -1: it has none.
struct DracoMesh {
  Mesh mesh;
  int position_id = -1;
  int normal_id = -1;
  int velocity_id = -1;
  int rest_id = -1;
};

// Errors: as DecodeMesh().  Threads: safe.
absl::StatusOr<DracoMesh> DecodeDracoMesh(const std::string& draco_bytes);

// Edgebreaker codes manifolds only, so at non-manifold edges the decoded parts have open edges with
// vertices of their own at the same places. Joins such vertices, but only along open edges:
// elsewhere distinct vertices may have been rounded to one place. Triangles that lose their area by
// this are dropped, and unused vertices.
// Cost: O(triangles log triangles); a mesh without open edges stays as it is.
void WeldOpenEdges(Mesh& mesh);

}  // namespace liquidblend
