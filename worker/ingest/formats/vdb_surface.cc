#include "worker/ingest/formats/vdb_surface.h"

#include <openvdb/tools/VolumeToMesh.h>

#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/parallel/this_thread.h"
#include "worker/ingest/formats/polygons.h"

namespace liquidblend::ingest {
namespace {

using openvdb::Coord;
using openvdb::FloatTree;
using Accessor = openvdb::tree::ValueAccessor<const FloatTree>;

constexpr int kLeafSide = FloatTree::LeafNodeType::DIM;

bool IsInside(float value) { return value < 0.0f; }

// Of the six steps to a neighbour, steps 0 to 2 go up.
Coord Step(int direction, int length) {
  Coord step(0, 0, 0);
  step[direction % 3] = direction < 3 ? length : -length;
  return step;
}

// Where a box of `side` voxels ends in a direction, and the next one begins.
Coord Beyond(const Coord& origin, int direction, int side) {
  return origin + Step(direction, direction < 3 ? side : 1);
}

// Narrow bands are leaves, so a surface between two tiles is none that a level set describes. It
// could be very large, too.
absl::Status CheckTiles(const FloatTree& tree) {
  const Accessor accessor(tree);
  FloatTree::ValueAllCIter tile = tree.cbeginValueAll();
  tile.setMaxDepth(FloatTree::ValueAllCIter::LEAF_DEPTH - 1);
  for (; tile; ++tile) {
    const openvdb::CoordBBox box = tile.getBoundingBox();
    const int side = box.dim().x();
    for (int direction = 0; direction < 6; ++direction) {
      const Coord next = Beyond(box.min(), direction, side);
      // Finer neighbours look back at this tile.
      if (accessor.getValueDepth(next) > static_cast<int>(tile.getDepth())) continue;
      if (IsInside(accessor.getValue(next)) == IsInside(*tile)) continue;
      return absl::InvalidArgumentError(
          absl::StrCat("the surface leaves the level set's narrow band at voxel (", next.x(), ", ",
                       next.y(), ", ", next.z(), ")"));
    }
  }
  return absl::OkStatus();
}

// Edges of the voxel grid that cross the surface and have an end in a leaf.
int64_t CountCrossings(const FloatTree& tree) {
  const Accessor accessor(tree);
  int64_t count = 0;
  for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) {
    for (auto voxel = leaf->cbeginValueAll(); voxel; ++voxel) {
      const Coord here = voxel.getCoord();
      const Coord local = here - leaf->origin();
      for (int direction = 0; direction < 6; ++direction) {
        const Coord next = here + Step(direction, 1);
        const int in_leaf = local[direction % 3] + (direction < 3 ? 1 : -1);
        const bool is_in_leaf = 0 <= in_leaf && in_leaf < kLeafSide;
        // Counted from below, unless there is no leaf below.
        if (direction >= 3 && (is_in_leaf || accessor.probeConstLeaf(next) != nullptr)) continue;
        const float value = is_in_leaf ? leaf->getValue(next) : accessor.getValue(next);
        count += IsInside(value) != IsInside(*voxel) ? 1 : 0;
      }
    }
  }
  return count;
}

}  // namespace

absl::StatusOr<mesh::TriangleMesh> MeshLevelSet(FloatTree::Ptr tree, int64_t max_crossings) {
  LB_RETURN_IF_ERROR(CheckTiles(*tree));
  if (const int64_t count = CountCrossings(*tree); count > max_crossings) {
    return absl::InvalidArgumentError(
        absl::StrCat("the surface crosses ", count, " edges of the voxel grid, more than the ",
                     max_crossings, " that so small a file is believed to hold"));
  }
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec4I> quads;
  const openvdb::FloatGrid grid(std::move(tree));  // its transform is the identity
  parallel::OnThisThread([&] { openvdb::tools::volumeToMesh(grid, points, quads, 0.0); });
  mesh::TriangleMesh mesh;
  mesh.vertices.resize(3, static_cast<Eigen::Index>(points.size()));
  for (size_t v = 0; v < points.size(); ++v) {
    mesh.vertices.col(static_cast<Eigen::Index>(v)) << points[v].x(), points[v].y(), points[v].z();
  }
  Polygons polygons;
  polygons.num_corners.assign(quads.size(), 4);
  polygons.corners.reserve(4 * quads.size());
  for (const openvdb::Vec4I& quad : quads) {
    for (int c = 0; c < 4; ++c) polygons.corners.push_back(static_cast<int32_t>(quad[c]));
  }
  LB_ASSIGN_OR_RETURN(mesh.triangles, Triangulate(polygons, mesh.vertices));
  return mesh;
}

}  // namespace liquidblend::ingest
