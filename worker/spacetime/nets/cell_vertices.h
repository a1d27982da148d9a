// The vertices of one 4D cell. Internal to worker/spacetime.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "worker/spacetime/nets/cut_cell.h"
#include "worker/spacetime/nets/layer.h"

namespace liquidblend::spacetime {

struct Cell {
  // The layers must outlive it.
  Cell(std::span<const Layer* const> of_layers, int x0, int y0, int z0, float with_motion)
      : layers(of_layers),
        i(x0),
        j(y0),
        k(z0),
        motion(with_motion),
        first(layers.front()->AtCorners(i, j, k)),
        last(layers.back()->AtCorners(i, j, k)) {}

  std::span<const Layer* const> layers;  // from its first to its last one
  int i, j, k;
  float motion;  // spacings that one metre per second covers from the first to the last layer
  Layer::Corners first, last;

  // Corners are numbered by their bits x, y, z, t.
  float Distance(int c) const { return c < 8 ? first.Distance(c) : last.Distance(c - 8); }
  Eigen::Vector3f Gradient(int c) const { return c < 8 ? first.Gradient(c) : last.Gradient(c - 8); }
  int x(int c) const { return i + (c & 1); }
  int y(int c) const { return j + (c >> 1 & 1); }
  int z(int c) const { return k + (c >> 2 & 1); }
};

// Sets `placed` to one vertex per sheet of the surface, each where the tangent planes of the
// surface near the ends of the sheet's edges meet; in [0, 1]^4 within the cell, except for vertices
// of thin sheets, which may lie further out in space.
//   inside  bit c: corner c is inside
void PlaceInCell(const Cell& cell, uint16_t inside, std::vector<Eigen::Vector4f>& placed);

// The same for a cut cell.
void PlaceInCutCell(const Cell& cell, const CutCell& cut, std::vector<Eigen::Vector4f>& placed);

}  // namespace liquidblend::spacetime
