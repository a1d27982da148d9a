// Integers of a rounded surface -> floats. Decoded frames and those that a player makes of a file
// go the same way, so they are the same to the bit.
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace liquidblend::client {

// A surface in integers, as liquidblend.v1.MeshoptMesh describes it.
struct PackedMesh {
  std::span<const std::array<uint16_t, 4>> positions;
  std::span<const std::array<uint32_t, 3>> triangles;
  std::span<const std::array<int16_t, 2>> normals;     // empty: none
  std::span<const std::array<int16_t, 4>> velocities;  // empty: none
  std::span<const std::array<uint16_t, 4>> rest;       // empty: none
  std::array<float, 3> origin_m = {0, 0, 0};
  float step_m = 0.0F;
  float velocity_step_m_s = 0.0F;
  std::array<float, 3> rest_origin_m = {0, 0, 0};
  float rest_step_m = 0.0F;
  float rest_origin_s = 0.0F;
  float rest_step_s = 0.0F;
};

// Memory for a mesh, three floats a vertex (four of a rest position) and three indices a triangle.
// What is null is left out; so is what the packed mesh does not have.
struct MeshMemory {
  float* positions = nullptr;
  float* normals = nullptr;
  float* velocities = nullptr;
  float* rest = nullptr;
  uint32_t* triangles = nullptr;
};

// Writes the mesh. Each triangle begins with its lowest vertex.
// Requires: `out` has room for as many vertices and triangles.  Threads: safe.
void Unpack(const PackedMesh& packed, const MeshMemory& out);

}  // namespace liquidblend::client
