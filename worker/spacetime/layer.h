// The signed distance to the liquid at one time, on the points of a grid. Internal to
// worker/spacetime.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "worker/spacetime/distance_band.h"
#include "worker/spacetime/grid.h"
#include "worker/spacetime/sheet_points.h"
#include "worker/spacetime/slab_steps.h"

namespace liquidblend::spacetime {

// Distances and gradients are in grid units, negative inside.
class Layer {
 public:
  // The distance to one surface.
  //   sheet_motion  spacings that one metre per second goes from layer to layer; without it, thin
  //                 sheets get no points of their own
  // Requires: a closed, oriented surface within the grid.
  Layer(const Grid& grid, GridSurface surface, std::optional<float> sheet_motion = {});

  // The mean of the distances to two surfaces that show the same moment, weighted 1 - share and
  // share: a frame moved forward and the next one moved back. Known where `wanted` is cut.
  Layer(const Grid& grid, GridSurface forward, GridSurface backward, float share,
        const SlabSteps& wanted, std::optional<float> sheet_motion = {});

  // The sheet points among them, which may lie outside of the liquid.
  const InsideBits& inside() const { return inside_; }
  // Of the sheet in grid units if this is a point of a thin sheet (sheet_points.h); else 0.
  float SheetThickness(int i, int j, int k) const;
  // Whether one of rows j and j + 1 of planes k and k + 1 has a point of a thin sheet.
  bool HasSheetPoints(int j, int k) const;
  bool has_velocities() const;

  // Never zero; about kBandWidth beyond the band. Positive at sheet points outside of the liquid.
  float Distance(int i, int j, int k) const;
  // Exact, also at sharp edges, where the distance is; zero beyond the band.
  Eigen::Vector3f Gradient(int i, int j, int k) const;
  // The same at the corners of a voxel.
  class Corners;
  Corners AtCorners(int i, int j, int k) const;
  // Of the liquid where the surface is closest to the point; zero beyond the band.
  Eigen::Vector3f SurfaceVelocity(int i, int j, int k) const;

 private:
  struct Part {
    Part(const Grid& grid, GridSurface s, float w, const SlabSteps* wanted);
    float Distance(int i, int j, int k) const;
    Eigen::Vector3f Gradient(const DistanceBand::Entry& entry, bool is_inside) const;

    GridSurface surface;
    InsideBits inside;
    DistanceBand band;
    float weight;
  };
  // At p, of each part's triangle_of(part), if it is not -1.
  template <typename TriangleOf>
  Eigen::Vector3f MeanVelocity(const Eigen::Vector3f& p, TriangleOf&& triangle_of) const;
  void BlendInside(const Grid& grid);
  void MarkSheets(const Grid& grid, const GridSurface& surface, std::optional<float> motion);

  std::vector<Part> parts_;  // one or two
  InsideBits inside_;
  std::vector<SheetPoint> sheet_points_;
};

// What a layer, which must outlive it, knows at the corners of a voxel, numbered by their bits x,
// y, z.
class Layer::Corners {
 public:
  float Distance(int c) const { return distance_[c]; }
  Eigen::Vector3f Gradient(int c) const;
  // Of the liquid at p near the voxel, metres per second.
  Eigen::Vector3f Velocity(const Eigen::Vector3f& p) const;

 private:
  friend class Layer;
  struct OfPart {
    DistanceBand::Corners entries;
    uint8_t inside;  // bit c: corner c is
  };
  explicit Corners(const Layer& layer) : layer_(&layer) {}

  const Layer* layer_;
  std::array<OfPart, 2> parts_;
  std::array<float, 8> distance_;
};

}  // namespace liquidblend::spacetime
