// OpenVDB's own grids -> the bytes of its files.
#pragma once

#include <openvdb/openvdb.h>

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "tests/worker/ingest/formats/encode_files.h"

namespace liquidblend::ingest {

struct VdbGridSettings {
  std::string name = "surface";
  double voxel_size = 0.05;
  std::array<double, 3> translation = {0, 0, 0};
  openvdb::GridClass grid_class = openvdb::GRID_LEVEL_SET;
  bool is_half = false;
};

// A level set of a distance function, with a narrow band of three voxels, over the box of voxels
// [-extent, extent)^3.
openvdb::FloatGrid::Ptr LevelSet(const std::function<double(const openvdb::Vec3d&)>& distance,
                                 int extent, const VdbGridSettings& settings = {});

// The level set of a ball.
openvdb::FloatGrid::Ptr BallLevelSet(const openvdb::Vec3d& center, double radius,
                                     const VdbGridSettings& settings = {});

// velocity(world position) at voxels [-extent, extent)^3, or on their lower faces if staggered.
openvdb::Vec3SGrid::Ptr Velocities(
    const std::function<openvdb::Vec3d(const openvdb::Vec3d&)>& velocity, int extent,
    const VdbGridSettings& settings);

// A file as OpenVDB writes it. compression: a sum of openvdb::io's COMPRESS_...
Bytes Vdb(const openvdb::GridCPtrVec& grids, int compression);
Bytes Vdb(const openvdb::GridBase::ConstPtr& grid);

}  // namespace liquidblend::ingest
