// A level set in an OpenVDB tree -> its surface.
#pragma once

#include <openvdb/openvdb.h>

#include <cstdint>

#include "absl/status/statusor.h"
#include "core/mesh/triangle_mesh.h"

namespace liquidblend::ingest {

// The surface where the level set is 0, by dual contouring (openvdb::tools::volumeToMesh), in voxel
// indices, facing from negative values to positive ones; quads are cut into triangles.
//   max_crossings  how many edges between voxels may cross the surface: a quad each
// Errors: kInvalidArgument if more do, or the surface runs between tiles, outside of any narrow
// band. Throws OpenVDB's exceptions. Memory: 600 bytes a crossing, and three times the tree's.
absl::StatusOr<mesh::TriangleMesh> MeshLevelSet(openvdb::FloatTree::Ptr tree,
                                                int64_t max_crossings);

}  // namespace liquidblend::ingest
