// OpenVDB: a level set and, optionally, velocities.
#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <exception>
#include <new>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/data_limit.h"
#include "core/base/status_macros.h"
#include "worker/ingest/formats/readers.h"
#include "worker/ingest/formats/text.h"
#include "worker/ingest/formats/vdb_file.h"
#include "worker/ingest/formats/vdb_surface.h"
#include "worker/ingest/formats/vdb_tree.h"

namespace liquidblend::ingest {
namespace {

constexpr std::string_view kFloatType = "Tree_float_5_4_3";
constexpr std::string_view kVectorType = "Tree_vec3s_5_4_3";
constexpr std::string_view kLevelSetNames[] = {"surface", "density"};
constexpr std::string_view kVelocityNames[] = {"velocity", "vel", "v"};
constexpr std::string_view kLevelSet = "level set";
constexpr std::string_view kFogVolume = "fog volume";
constexpr std::string_view kStaggered = "staggered";

// Narrow bands take 10 bytes or more for each edge that crosses the surface.
constexpr int64_t kFreeCrossings = 1 << 14;
constexpr int64_t kBytesPerCrossing = 4;

constexpr double kLargestIndex = 1e9;  // where velocities are looked up: fits an int

std::string ListOf(const std::vector<VdbGrid>& grids) {
  std::string list;
  for (const VdbGrid& grid : grids) {
    absl::StrAppend(&list, list.empty() ? "" : ", ", Quoted(grid.name), " (",
                    Quoted(grid.grid_class), ", ", Quoted(grid.type), ")");
  }
  return grids.empty() ? "it has no grid" : absl::StrCat("its grids are ", list);
}

// Grids written without a class count as level sets here; their background tells.
bool MayBeLevelSet(const VdbGrid& grid) {
  return grid.type == kFloatType && grid.grid_class != kFogVolume && grid.grid_class != kStaggered;
}

// By name, else the first that says it is one.
absl::StatusOr<const VdbGrid*> FindLevelSet(const std::vector<VdbGrid>& grids) {
  for (const std::string_view name : kLevelSetNames) {
    for (const VdbGrid& grid : grids) {
      if (grid.name == name && MayBeLevelSet(grid)) return &grid;
    }
  }
  for (const VdbGrid& grid : grids) {
    if (grid.type == kFloatType && grid.grid_class == kLevelSet) return &grid;
  }
  for (const VdbGrid& grid : grids) {
    if (grid.grid_class != kFogVolume) continue;
    return absl::InvalidArgumentError(absl::StrCat(
        "grid ", Quoted(grid.name), " is a fog volume, which has no surface: write a level set"));
  }
  return absl::InvalidArgumentError(
      absl::StrCat("no grid of floats is a level set; ", ListOf(grids)));
}

const VdbGrid* FindVelocities(const std::vector<VdbGrid>& grids) {
  for (const std::string_view name : kVelocityNames) {
    for (const VdbGrid& grid : grids) {
      if (grid.name == name && grid.type == kVectorType) return &grid;
    }
  }
  return nullptr;
}

absl::Status WithGrid(const absl::Status& status, const VdbGrid& grid) {
  return absl::Status(
      status.code(), absl::StrCat("grid ", Quoted(grid.name), ": ", std::string(status.message())));
}

absl::StatusOr<mesh::TriangleMesh> ReadSurface(const VdbGrid& grid) {
  LB_ASSIGN_OR_RETURN(openvdb::FloatTree::Ptr tree, ReadVdbFloatTree(grid));
  if (!(tree->background() > 0.0f)) {
    return absl::InvalidArgumentError(
        absl::StrCat("its background is ", tree->background(),
                     ", not above 0 as outside of a level set's narrow band; is it a fog volume?"));
  }
  const auto size = static_cast<int64_t>(grid.tree.size());
  LB_ASSIGN_OR_RETURN(mesh::TriangleMesh mesh,
                      MeshLevelSet(std::move(tree), kFreeCrossings + size / kBytesPerCrossing));
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    const Eigen::Vector3d index = mesh.vertices.col(v).cast<double>();
    const Eigen::Vector3d world = grid.world_from_index.topRows<3>() * index.homogeneous();
    for (int axis = 0; axis < 3; ++axis) mesh.vertices(axis, v) = ToFloat(world[axis]);
  }
  // A mirroring transform turns the triangles inside out.
  const bool is_mirrored = grid.world_from_index.topLeftCorner<3, 3>().determinant() < 0;
  for (Eigen::Index t = 0; is_mirrored && t < mesh.triangles.cols(); ++t) {
    std::swap(mesh.triangles(1, t), mesh.triangles(2, t));
  }
  return mesh;
}

template <typename Sampler>
absl::Status Sample(const VdbGrid& grid, const openvdb::Vec3STree& tree, mesh::TriangleMesh& mesh) {
  const openvdb::tree::ValueAccessor<const openvdb::Vec3STree> accessor(tree);
  const Eigen::Matrix4d index_from_world = grid.world_from_index.inverse();
  mesh.velocities.resize(3, mesh.vertices.cols());
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    const Eigen::Vector3d world = mesh.vertices.col(v).cast<double>();
    const Eigen::Vector3d index = index_from_world.topRows<3>() * world.homogeneous();
    if (!(index.cwiseAbs().maxCoeff() < kLargestIndex)) {
      return absl::InvalidArgumentError(
          absl::StrCat("vertex ", v, " of the surface lies beyond voxel ", kLargestIndex));
    }
    const openvdb::Vec3s velocity =
        Sampler::sample(accessor, openvdb::Vec3R(index.x(), index.y(), index.z()));
    mesh.velocities.col(v) << velocity.x(), velocity.y(), velocity.z();
  }
  return absl::OkStatus();
}

absl::Status ReadVelocities(const VdbGrid& grid, mesh::TriangleMesh& mesh) {
  LB_ASSIGN_OR_RETURN(const openvdb::Vec3STree::Ptr tree, ReadVdbVectorTree(grid));
  return grid.grid_class == kStaggered
             ? Sample<openvdb::tools::StaggeredBoxSampler>(grid, *tree, mesh)
             : Sample<openvdb::tools::BoxSampler>(grid, *tree, mesh);
}

absl::StatusOr<VdbFrame> ReadVdbFrame(std::span<const std::byte> bytes) {
  LB_ASSIGN_OR_RETURN(const std::vector<VdbGrid> grids, ReadVdbGrids(bytes));
  LB_ASSIGN_OR_RETURN(const VdbGrid* const level_set, FindLevelSet(grids));
  absl::StatusOr<mesh::TriangleMesh> mesh = ReadSurface(*level_set);
  if (!mesh.ok()) return WithGrid(mesh.status(), *level_set);
  VdbFrame frame;
  frame.mesh = *std::move(mesh);
  frame.level_set = level_set->name;
  const VdbGrid* const velocities = FindVelocities(grids);
  if (velocities == nullptr) return frame;
  const absl::Status status = ReadVelocities(*velocities, frame.mesh);
  if (!status.ok()) return WithGrid(status, *velocities);
  frame.velocities = velocities->name;
  return frame;
}

}  // namespace

absl::StatusOr<VdbFrame> ReadVdb(std::span<const std::byte> bytes) {
  try {
    return ReadVdbFrame(bytes);
  } catch (const std::bad_alloc&) {
    return base::MemoryLimitError("there is not enough memory for the voxels");
  } catch (const std::exception& error) {  // OpenVDB's
    return absl::InvalidArgumentError(absl::StrCat("OpenVDB: ", error.what()));
  }
}

}  // namespace liquidblend::ingest
