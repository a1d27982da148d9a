// Distance to a surface in a narrow band around it, stored sparsely. Internal to worker/spacetime.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "worker/spacetime/field/grid.h"

namespace liquidblend::spacetime {

// Unsigned distances in grid units at the grid points within about kBandWidth of the surface, and
// the triangle that is closest. Memory: blocks of 8^3 points that touch the band.
class DistanceBand {
 public:
  static constexpr float kBandWidth = 4.0f;

  // Values at a grid point.
  struct Entry {
    float distance = kBandWidth;  // kBandWidth beyond the band
    int32_t triangle = -1;        // the closest one; -1 beyond the band
    // From the closest point to the grid point; zero beyond the band.
    Eigen::Vector3f offset = Eigen::Vector3f::Zero();
  };
  // Entries of a voxel's corners, numbered by their bits x, y, z.
  using Corners = std::array<const Entry*, 8>;

  // Distances are exact next to the surface. Further out the closest triangle is propagated from
  // point to point, so distances may be up to a tenth of a spacing too large.
  //   needed  if not null: the points whose distances are needed
  DistanceBand(const Grid& grid, const GridSurface& surface, const PointBits* needed = nullptr);

  const Entry& At(int i, int j, int k) const {
    const int32_t block = block_of_[BlockIndex(i, j, k)];
    return block < 0 ? kBeyond : blocks_[block][Slot(i, j, k)];
  }
  Corners AtCorners(int i, int j, int k) const;
  float Distance(int i, int j, int k) const { return At(i, j, k).distance; }
  int32_t Triangle(int i, int j, int k) const { return At(i, j, k).triangle; }

 private:
  using Block = std::array<Entry, 512>;
  using Point = std::array<int, 3>;

  static int Slot(int i, int j, int k) { return (i & 7) | (j & 7) << 3 | (k & 7) << 6; }
  int64_t BlockIndex(int i, int j, int k) const {
    return (static_cast<int64_t>(k >> 3) * block_dims_[1] + (j >> 3)) * block_dims_[0] + (i >> 3);
  }
  // Requires: the point's block is there (AddBlocks).
  Entry& EntryAt(int i, int j, int k) {
    return blocks_[block_of_[BlockIndex(i, j, k)]][Slot(i, j, k)];
  }
  void AddBlocks(const Grid& grid, const PointBits& points);
  void Fill(const Grid& grid, const GridSurface& surface, const PointBits& needed);
  // Points that are not next to the surface, or not known yet.
  struct FarPoints {
    std::vector<Point> known, unknown;
  };
  FarPoints Rasterize(const Grid& grid, const GridSurface& surface, const PointBits& needed);
  void Rasterize(const GridSurface& surface, int32_t t, const PointBits& needed);
  static PointBits WaysTo(const Grid& grid, const std::vector<Point>& unknown,
                          const PointBits& needed);
  void Grow(const GridSurface& surface, std::vector<Point> points);
  int32_t TriangleAround(const Point& p) const;

  static const Entry kBeyond;
  std::array<int, 3> dims_, block_dims_;
  std::vector<int32_t> block_of_;
  std::vector<Block> blocks_;
};

// The point of triangle (a, b, c) that is closest to p, as barycentric coordinates.
Eigen::Vector3f ClosestBarycentric(const Eigen::Vector3f& p, const Eigen::Vector3f& a,
                                   const Eigen::Vector3f& b, const Eigen::Vector3f& c);

}  // namespace liquidblend::spacetime
