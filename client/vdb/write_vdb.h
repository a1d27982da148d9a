// Signed distance field of a mesh as an OpenVDB file.
//
// A module that the command line loads when it needs it: OpenVDB takes 55 MB on disk, and 0.1 s and
// 28 MB at every start of a program that links it.
#pragma once

#include <cstddef>
#include <cstdint>

namespace liquidblend::vdb {

struct WriteRequest {
  const float* positions = nullptr;  // x, y, z per vertex, metres
  size_t num_vertices = 0;
  const uint32_t* triangles = nullptr;  // three vertex indices each
  size_t num_triangles = 0;
  const float* velocities = nullptr;  // x, y, z per vertex, metres per second; or null
  double voxel_size_m = 0.0;          // > 0
  const char* path = nullptr;
};

// Writes a level set "surface", three voxels to both sides, and with velocities a grid "velocity"
// on the same voxels: each has the mean of its closest triangle.
// Returns null, or what went wrong: a text that lives until the thread's next call.
// Requires: a closed, oriented mesh; indices in range.  Threads: safe.
using WriteFunction = const char* (*)(const WriteRequest* request);
inline constexpr char kWriteFunctionName[] = "LiquidblendWriteVdb";

}  // namespace liquidblend::vdb
