#include "client/vdb/write_vdb.h"

#include <openvdb/io/Archive.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/MeshToVolume.h>

#include <exception>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace liquidblend::vdb {
namespace {

constexpr float kHalfWidth = 3.0f;  // voxels

using Indices = openvdb::Int32Grid;

std::vector<openvdb::Vec3s> PointsOf(const WriteRequest& request,
                                     const openvdb::math::Transform& transform) {
  std::vector<openvdb::Vec3s> points;
  points.reserve(request.num_vertices);
  for (size_t v = 0; v < request.num_vertices; ++v) {
    const float* p = request.positions + 3 * v;
    points.emplace_back(transform.worldToIndex(openvdb::Vec3d(p[0], p[1], p[2])));
  }
  return points;
}

std::vector<openvdb::Vec3I> TrianglesOf(const WriteRequest& request) {
  std::vector<openvdb::Vec3I> triangles;
  triangles.reserve(request.num_triangles);
  for (size_t t = 0; t < request.num_triangles; ++t) {
    const uint32_t* v = request.triangles + 3 * t;
    triangles.emplace_back(v[0], v[1], v[2]);
  }
  return triangles;
}

// Mean of a triangle's three corners.
openvdb::Vec3s VelocityOf(const WriteRequest& request, size_t triangle) {
  openvdb::Vec3s sum(0.0f);
  for (size_t k = 0; k < 3; ++k) {
    sum += openvdb::Vec3s(request.velocities + size_t{3} * request.triangles[3 * triangle + k]);
  }
  return sum / 3.0f;
}

openvdb::GridBase::Ptr Velocities(const WriteRequest& request, const openvdb::FloatGrid& surface,
                                  const Indices& closest) {
  openvdb::Vec3SGrid::Ptr grid = openvdb::Vec3SGrid::create();
  grid->setTransform(surface.transform().copy());
  grid->setName("velocity");
  auto out = grid->getAccessor();
  auto index = closest.getConstAccessor();
  for (auto voxel = surface.cbeginValueOn(); voxel; ++voxel) {
    const int32_t triangle = index.getValue(voxel.getCoord());
    if (triangle < 0 || static_cast<size_t>(triangle) >= request.num_triangles) continue;
    out.setValue(voxel.getCoord(), VelocityOf(request, static_cast<size_t>(triangle)));
  }
  return grid;
}

// A .vdb file with offsets of its grids. openvdb::io::File reports no write that fails.
class VdbFile : public openvdb::io::Archive {
 public:
  void Write(const char* path, const openvdb::GridPtrVec& grids) {
    std::ofstream file(path, std::ios::binary);
    if (!file) throw std::runtime_error("cannot be written");
    setCompression(openvdb::io::COMPRESS_ZIP | openvdb::io::COMPRESS_ACTIVE_MASK);
    Archive::write(file, grids, /*seekable=*/true);
    file.close();
    if (!file) throw std::runtime_error("cannot be written; is the disk full?");
  }
};

void Write(const WriteRequest& request) {
  openvdb::initialize();
  const auto transform = openvdb::math::Transform::createLinearTransform(request.voxel_size_m);
  const std::vector<openvdb::Vec3s> points = PointsOf(request, *transform);
  const std::vector<openvdb::Vec3I> triangles = TrianglesOf(request);
  const openvdb::tools::QuadAndTriangleDataAdapter<openvdb::Vec3s, openvdb::Vec3I> mesh(points,
                                                                                        triangles);
  Indices closest(-1);
  openvdb::util::NullInterrupter interrupter;
  const openvdb::FloatGrid::Ptr surface = openvdb::tools::meshToVolume<openvdb::FloatGrid>(
      interrupter, mesh, *transform, kHalfWidth, kHalfWidth, 0, &closest);
  surface->setName("surface");
  surface->setGridClass(openvdb::GRID_LEVEL_SET);
  openvdb::GridPtrVec grids = {surface};
  if (request.velocities != nullptr) grids.push_back(Velocities(request, *surface, closest));
  VdbFile().Write(request.path, grids);
}

}  // namespace

// The one place that catches what OpenVDB throws.
extern "C" __attribute__((visibility("default"))) const char* LiquidblendWriteVdb(
    const WriteRequest* request) {
  thread_local std::string error;
  try {
    Write(*request);
    return nullptr;
  } catch (const std::exception& exception) {
    error = exception.what();
    return error.c_str();
  }
}

}  // namespace liquidblend::vdb
