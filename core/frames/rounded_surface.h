// Surface rounded to grids: what fast decoders get, and what a player makes itself of a family's
// file.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/frames/grid.h"
#include "core/mesh/triangle_mesh.h"

namespace liquidblend::frames {

inline constexpr int kMaxRoundedBits = 16;    // of a coordinate
inline constexpr int kNormalLimit = 511;      // 10 bits, octahedral: a tenth of a degree
inline constexpr int kVelocityLimit = 8191;   // 14 bits of the frame's own range
inline constexpr int kRestPositionBits = 16;  // of each coordinate, and of the time

// Options of rounding.
struct RoundingOptions {
  Grid grid;                // finite; of the family
  int position_bits = 14;   // [kMinPositionBits, kMaxRoundedBits]
  double duration_s = 0.0;  // >= 0; of the family: rest positions have times up to it
};

// A surface in integers. A fourth number is 0 unless it is said what it is.
struct RoundedSurface {
  std::array<float, 3> origin_m = {0, 0, 0};
  float step_m = 0.0F;
  std::vector<std::array<uint16_t, 4>> positions;  // origin_m + step_m * n
  std::vector<std::array<uint32_t, 3>> triangles;
  // Empty: not known.
  std::vector<std::array<int16_t, 2>> normals;     // octahedral, in [-kNormalLimit, kNormalLimit]
  std::vector<std::array<int16_t, 4>> velocities;  // velocity_step_m_s * n
  std::vector<std::array<uint16_t, 4>> rest;       // origin_m + rest_step_m * n; rest_step_s * n
  float velocity_step_m_s = 0.0F;
  float rest_step_m = 0.0F;
  float rest_step_s = 0.0F;
};

// Rounds a surface. Positions are off by at most half a step, except those outside of the grid,
// which are moved onto its border first; they are those that a Draco mesh of the same grid has.
// Triangles that name a vertex twice and vertices of no triangle are left out. The others keep
// their order, and vertices are numbered by their first use.
// Requires: mesh passed Validate(); options are in range.  Threads: safe, same bytes always.
// Cost: about 20 ns per vertex and triangle.
RoundedSurface RoundSurface(const mesh::TriangleMesh& mesh, const RoundingOptions& options);

}  // namespace liquidblend::frames
