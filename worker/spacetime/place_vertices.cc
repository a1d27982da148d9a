#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "worker/spacetime/cell_sheets.h"
#include "worker/spacetime/surface_nets.h"

namespace liquidblend::spacetime {
namespace {

constexpr float kTimeMargin = 0.05f;  // vertices stay this far from the layers, in slabs
// Steps towards the point where a cell's planes meet; each leaves directions that no plane holds
// nearly as they are.
constexpr int kMeetSteps = 3;
constexpr float kDamping = 0.05f;  // per plane
// The sides of a sheet may be further from its points than the points are from one another.
constexpr float kBeyondCell = 1.5f;
constexpr float kMinSlope = 0.1f;  // of a plane in space

// The 16 signed distances at the corners of a 4D cell; bits of the index: x, y, z, t.
using Corners = std::array<float, 16>;

Eigen::Vector4f CornerOf(int c) {
  return Eigen::Vector4i(c & 1, c >> 1 & 1, c >> 2 & 1, c >> 3 & 1).cast<float>();
}

struct Cell {
  const Layer& earlier;
  const Layer& later;
  int i, j, k;

  const Layer& LayerOf(int c) const { return (c & 8) != 0 ? later : earlier; }
  int x(int c) const { return i + (c & 1); }
  int y(int c) const { return j + (c >> 1 & 1); }
  int z(int c) const { return k + (c >> 2 & 1); }
};

Corners Sample(const Cell& cell) {
  Corners phi;
  for (int c = 0; c < 16; ++c) phi[c] = cell.LayerOf(c).Distance(cell.x(c), cell.y(c), cell.z(c));
  return phi;
}

// A margin in space would push walls that lie in a grid plane off it.
//   beyond  how far outside of the cell it may be in space
Eigen::Vector4f ClampToCell(const Eigen::Vector4f& p, float beyond = 0.0f) {
  Eigen::Vector4f clamped = p.cwiseMax(-beyond).cwiseMin(1.0f + beyond);
  clamped.w() = std::clamp(clamped.w(), kTimeMargin, 1.0f - kTimeMargin);
  return clamped;
}

// Calls visit(axis, lower corner, upper corner) for each edge of a sheet.
template <typename Visit>
void ForEachEdge(uint32_t edges, Visit&& visit) {
  for (int axis = 0; axis < 4; ++axis) {
    for (int lower = 0; lower < 16; ++lower) {
      if ((lower >> axis & 1) != 0 || (edges >> CellEdge(axis, lower) & 1) == 0) continue;
      visit(axis, lower, lower | 1 << axis);
    }
  }
}

// Mean of the zero crossings on a sheet's edges.
Eigen::Vector4f MeanCrossing(const Corners& phi, uint32_t edges) {
  Eigen::Vector4f sum = Eigen::Vector4f::Zero();
  int count = 0;
  ForEachEdge(edges, [&](int axis, int lower, int upper) {
    Eigen::Vector4f p = CornerOf(lower);
    p[axis] = phi[lower] / (phi[lower] - phi[upper]);
    sum += p;
    ++count;
  });
  return ClampToCell(sum / static_cast<float>(count));
}

// Mean of the middles of a sheet's edges.
Eigen::Vector4f Middle(uint32_t edges) {
  Eigen::Vector4f sum = Eigen::Vector4f::Zero();
  int count = 0;
  ForEachEdge(edges, [&](int, int lower, int upper) {
    sum += 0.5f * (CornerOf(lower) + CornerOf(upper));
    ++count;
  });
  return sum / static_cast<float>(count);
}

// Hyperplanes that touch the space-time surface: normal . p = offset.
struct Planes {
  std::array<Eigen::Vector4f, 16> normal;  // unit length
  std::array<float, 16> offset;
  int count = 0;
};

// Bits of the ends of a sheet's edges.
uint32_t EndsOf(uint32_t edges) {
  uint32_t corners = 0;
  ForEachEdge(edges, [&](int, int lower, int upper) {
    corners |= uint32_t{1} << lower | uint32_t{1} << upper;
  });
  return corners;
}

// One plane for each of the corners: where its distance, continued along its gradient, is zero. The
// slope in time comes from the other layer.
Planes TangentPlanes(const Cell& cell, const Corners& phi, uint32_t corners) {
  Planes planes;
  for (int c = 0; c < 16; ++c) {
    if ((corners >> c & 1) == 0) continue;
    Eigen::Vector4f gradient;
    gradient << cell.LayerOf(c).Gradient(cell.x(c), cell.y(c), cell.z(c)), phi[c | 8] - phi[c & 7];
    const float length = gradient.norm();
    if (!(length > 1e-3f)) continue;
    planes.normal[planes.count] = gradient / length;
    planes.offset[planes.count] = (gradient.dot(CornerOf(c)) - phi[c]) / length;
    ++planes.count;
  }
  return planes;
}

// The point nearest to all planes in the least-squares sense, from p: sharp edges of the surface
// (walls meeting, say) keep their place, which the zero set of interpolated distances rounds off.
Eigen::Vector4f Meet(const Planes& planes, Eigen::Vector4f p, float beyond = 0.0f) {
  if (planes.count == 0) return p;
  Eigen::Matrix4f normal_matrix =
      kDamping * static_cast<float>(planes.count) * Eigen::Matrix4f::Identity();
  for (int n = 0; n < planes.count; ++n) {
    normal_matrix += planes.normal[n] * planes.normal[n].transpose();
  }
  const Eigen::LLT<Eigen::Matrix4f> factor(normal_matrix);
  for (int step = 0; step < kMeetSteps; ++step) {
    Eigen::Vector4f rhs = Eigen::Vector4f::Zero();
    for (int n = 0; n < planes.count; ++n) {
      rhs += (planes.offset[n] - planes.normal[n].dot(p)) * planes.normal[n];
    }
    p += factor.solve(rhs);
  }
  return ClampToCell(p, beyond);
}

// The mean thickness of thin sheets at the cell's corners; 0: there are none.
float SheetThickness(const Cell& cell, uint16_t inside) {
  float sum = 0;
  int count = 0;
  for (int c = 0; c < 16; ++c) {
    if ((inside >> c & 1) == 0) continue;
    const float thickness = cell.LayerOf(c).SheetThickness(cell.x(c), cell.y(c), cell.z(c));
    sum += thickness;
    count += thickness > 0 ? 1 : 0;
  }
  return count > 0 ? sum / static_cast<float>(count) : 0;
}

// Where the edges of a sheet of the surface lead out of the liquid.
Eigen::Vector3f Outward(uint16_t inside, uint32_t edges) {
  Eigen::Vector3f outward = Eigen::Vector3f::Zero();
  ForEachEdge(edges, [&](int axis, int lower, int) {
    if (axis < 3) outward[axis] += (inside >> lower & 1) != 0 ? 1.0f : -1.0f;
  });
  return outward;
}

// The same planes half-way in time; without those that hardly depend on the place.
Planes HalfWay(const Planes& planes) {
  Planes result;
  for (int n = 0; n < planes.count; ++n) {
    Eigen::Vector4f normal = planes.normal[n];
    const float offset = planes.offset[n] - 0.5f * normal.w();
    normal.w() = 0;
    const float length = normal.norm();
    if (!(length > kMinSlope)) continue;
    result.normal[result.count] = normal / length;
    result.offset[result.count] = offset / length;
    ++result.count;
  }
  return result;
}

// For a thin sheet, whose sides must not be mistaken for one another: on the side that the edges
// lead to, and half-way in time, so that slices have no other parts and holes than the layers.
Eigen::Vector4f PlaceOnSide(const Cell& cell, uint16_t inside, const Corners& phi, uint32_t edges,
                            float thickness) {
  const Eigen::Vector3f outward = Outward(inside, edges);
  Corners to_side = phi;
  uint32_t nearest = 0;  // corners that this side is the nearest to
  for (int c = 0; c < 16; ++c) {
    if (cell.LayerOf(c).Gradient(cell.x(c), cell.y(c), cell.z(c)).dot(outward) > 0) {
      nearest |= uint32_t{1} << c;
    } else {
      to_side[c] = -phi[c] - thickness;
    }
  }
  Eigen::Vector4f middle = Middle(edges);
  middle.w() = 0.5f;
  return Meet(HalfWay(TangentPlanes(cell, to_side, nearest & EndsOf(edges))), middle, kBeyondCell);
}

// Bits of the cells of row (j, k) whose corners are mixed.
void MixedCells(const Grid& grid, const InsideBits& earlier, const InsideBits& later, int j, int k,
                std::vector<uint64_t>& mixed) {
  const int num_words = grid.words_per_row();
  std::array<const uint64_t*, 8> rows;
  for (int r = 0; r < 4; ++r) {
    rows[r] = earlier.Row(j + (r & 1), k + (r >> 1));
    rows[r + 4] = later.Row(j + (r & 1), k + (r >> 1));
  }
  std::vector<uint64_t> any(num_words + 1, 0), all(num_words + 1, 0);
  for (int w = 0; w < num_words; ++w) {
    all[w] = ~uint64_t{0};
    for (const uint64_t* row : rows) {
      any[w] |= row[w];
      all[w] &= row[w];
    }
  }
  mixed.assign(num_words, 0);
  for (int w = 0; w < num_words; ++w) {
    const uint64_t any_next = any[w] >> 1 | any[w + 1] << 63;
    const uint64_t all_next = all[w] >> 1 | all[w + 1] << 63;
    mixed[w] = (any[w] | any_next) & ~(all[w] & all_next);
  }
}

}  // namespace

uint16_t InsideCorners(const InsideBits& earlier, const InsideBits& later, int i, int j, int k) {
  unsigned bits = 0;
  for (int c = 0; c < 16; ++c) {
    const InsideBits& layer = (c & 8) != 0 ? later : earlier;
    if (layer.At(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2 & 1))) bits |= 1u << c;
  }
  return static_cast<uint16_t>(bits);
}

Slab PlaceVertices(const Grid& grid, const Layer& earlier, const Layer& later) {
  Slab slab;
  slab.row_begin.reserve(grid.num_rows() + 1);
  const bool has_velocities = earlier.has_velocities() && later.has_velocities();
  std::vector<uint64_t> mixed;
  for (int k = 0; k < grid.dims[2]; ++k) {
    for (int j = 0; j < grid.dims[1]; ++j) {
      slab.row_begin.push_back(slab.num_cells());
      if (j + 1 == grid.dims[1] || k + 1 == grid.dims[2]) continue;
      MixedCells(grid, earlier.inside(), later.inside(), j, k, mixed);
      const bool has_sheets = earlier.HasSheetPoints(j, k) || later.HasSheetPoints(j, k);
      ForEachBit(mixed.data(), grid.words_per_row(), [&](int i) {
        const Cell cell{earlier, later, i, j, k};
        const Corners phi = Sample(cell);
        const uint16_t inside = InsideCorners(earlier.inside(), later.inside(), i, j, k);
        slab.cell_i.push_back(i);
        slab.cell_inside.push_back(inside);
        slab.first_vertex.push_back(static_cast<int32_t>(slab.num_vertices()));
        const CellSheets sheets = FindSheets(inside);
        const float thickness = has_sheets ? SheetThickness(cell, inside) : 0;
        for (int n = 0; n < sheets.count; ++n) {
          const uint32_t edges = sheets.edges[n];
          const Eigen::Vector4f local =
              thickness > 0
                  ? PlaceOnSide(cell, inside, phi, edges, thickness)
                  : Meet(TangentPlanes(cell, phi, EndsOf(edges)), MeanCrossing(phi, edges));
          const Eigen::Vector4f p = local + Eigen::Vector4i(i, j, k, 0).cast<float>();
          slab.vertices.push_back(p);
          if (!has_velocities) continue;
          slab.velocities.push_back((1.0f - p.w()) * earlier.Velocity(i, j, k, p.head<3>()) +
                                    p.w() * later.Velocity(i, j, k, p.head<3>()));
        }
      });
    }
  }
  slab.row_begin.push_back(slab.num_cells());
  return slab;
}

}  // namespace liquidblend::spacetime
