#include "tests/worker/ingest/formats/encode_vdb.h"

#include <gtest/gtest.h>
#include <openvdb/io/File.h>
#include <openvdb/tools/SignedFloodFill.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "absl/strings/str_cat.h"

namespace liquidblend::ingest {
namespace {

constexpr double kHalfWidth = 3.0;  // of a narrow band, voxels

void Configure(const VdbGridSettings& settings, openvdb::GridBase& grid) {
  grid.setName(settings.name);
  grid.setGridClass(settings.grid_class);
  grid.setSaveFloatAsHalf(settings.is_half);
  const auto transform = openvdb::math::Transform::createLinearTransform(settings.voxel_size);
  transform->postTranslate(openvdb::Vec3d(settings.translation.data()));
  grid.setTransform(transform);
}

}  // namespace

openvdb::FloatGrid::Ptr LevelSet(const std::function<double(const openvdb::Vec3d&)>& distance,
                                 int extent, const VdbGridSettings& settings) {
  const double band = kHalfWidth * settings.voxel_size;
  auto grid = openvdb::FloatGrid::create(static_cast<float>(band));
  Configure(settings, *grid);
  auto accessor = grid->getAccessor();
  for (int x = -extent; x < extent; ++x) {
    for (int y = -extent; y < extent; ++y) {
      for (int z = -extent; z < extent; ++z) {
        const openvdb::Coord voxel(x, y, z);
        const double value = distance(grid->indexToWorld(voxel));
        if (std::abs(value) < band) accessor.setValue(voxel, static_cast<float>(value));
      }
    }
  }
  openvdb::tools::signedFloodFill(grid->tree());
  return grid;
}

openvdb::FloatGrid::Ptr BallLevelSet(const openvdb::Vec3d& center, double radius,
                                     const VdbGridSettings& settings) {
  double farthest = radius;
  for (int axis = 0; axis < 3; ++axis) {
    farthest = std::max(farthest, std::abs(center[axis] - settings.translation[axis]) + radius);
  }
  const int extent = static_cast<int>(farthest / settings.voxel_size + kHalfWidth) + 2;
  return LevelSet([&](const openvdb::Vec3d& p) { return (p - center).length() - radius; }, extent,
                  settings);
}

openvdb::Vec3SGrid::Ptr Velocities(
    const std::function<openvdb::Vec3d(const openvdb::Vec3d&)>& velocity, int extent,
    const VdbGridSettings& settings) {
  auto grid = openvdb::Vec3SGrid::create(openvdb::Vec3s(0.0f));
  Configure(settings, *grid);
  auto accessor = grid->getAccessor();
  const bool is_staggered = settings.grid_class == openvdb::GRID_STAGGERED;
  for (int x = -extent; x < extent; ++x) {
    for (int y = -extent; y < extent; ++y) {
      for (int z = -extent; z < extent; ++z) {
        openvdb::Vec3s value;
        for (int axis = 0; axis < 3; ++axis) {
          openvdb::Vec3d place(x, y, z);
          if (is_staggered) place[axis] -= 0.5;
          value[axis] = static_cast<float>(velocity(grid->indexToWorld(place))[axis]);
        }
        accessor.setValue(openvdb::Coord(x, y, z), value);
      }
    }
  }
  return grid;
}

Bytes Vdb(const openvdb::GridCPtrVec& grids, int compression) {
  openvdb::initialize();
  static std::atomic<int> counter = 0;
  const std::string path =
      absl::StrCat(testing::TempDir(), "lb_", getpid(), "_", counter++, ".vdb");
  openvdb::io::File file(path);
  file.setCompression(static_cast<uint32_t>(compression));
  file.write(grids);
  file.close();
  Bytes bytes(std::filesystem::file_size(path));
  std::ifstream stream(path, std::ios::binary);
  stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  std::filesystem::remove(path);
  return bytes;
}

Bytes Vdb(const openvdb::GridBase::ConstPtr& grid) {
  return Vdb(openvdb::GridCPtrVec{grid},
             openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK);
}

}  // namespace liquidblend::ingest
