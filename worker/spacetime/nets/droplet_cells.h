// Droplets as cells of the space-time mesh. Internal to worker/spacetime.
#pragma once

#include <cstdint>
#include <vector>

#include "core/mesh/space_time_mesh.h"
#include "worker/spacetime/nets/droplets.h"

namespace liquidblend::spacetime {

// The vertices of one droplet at one time; where its shape changes from one frame's to the next
// one's, those of both.
struct DropletPiece {
  double time;                // frames
  Eigen::Matrix3Xf vertices;  // metres
  Eigen::Vector3f velocity;   // metres per second
};

// A droplet keeps each frame's shape from half-way after the frame before to half-way to the frame
// after, as a prism of wedges in time. Its centroid goes through that of each frame, between frames
// along its velocities. Each end of a prism is filled with tetrahedra that are flat in time, so
// that the cells are closed like all others.
struct DropletCells {
  using Corner = std::array<int32_t, 2>;  // piece, vertex of the piece
  std::vector<DropletPiece> pieces;       // ascending in time
  std::vector<std::array<Corner, 6>> wedges;
  std::vector<std::array<Corner, 4>> tetrahedra;
};

DropletCells MakeCells(const DropletTrack& track, const mesh::Animation& animation);

}  // namespace liquidblend::spacetime
