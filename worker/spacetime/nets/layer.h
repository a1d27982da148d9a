// Layer: the signed distance to the liquid at one time, on the points of a grid. Internal to
// worker/spacetime.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "worker/spacetime/field/distance_band.h"
#include "worker/spacetime/field/grid.h"
#include "worker/spacetime/nets/sheet_points.h"

namespace liquidblend::spacetime {

// Surfaces from which a layer is sampled.
struct LayerSource {
  // A surface of the liquid at the layer's time.
  struct View {
    GridSurface surface;
    InsideBits inside;
    float weight;
  };

  // One surface.
  //   sheet_motion  spacings that one metre per second covers from layer to layer; without it, thin
  //                 sheets get no points of their own
  // Requires: a closed, oriented surface within the grid.
  LayerSource(const Grid& grid, GridSurface surface, std::optional<float> sheet_motion = {});
  // A frame moved forward and the next one moved back, weighted 1 - share and share.
  LayerSource(const Grid& grid, GridSurface forward, GridSurface backward, float share,
              std::optional<float> sheet_motion = {});

  // Points that may be inside, those around thin sheets included; empty without thin sheets.
  InsideBits AroundSheets(const Grid& grid) const;

  std::vector<View> views;  // one or two
  std::vector<SheetPoint> sheet_points;
};

// Distances and gradients are in grid units, negative inside.
class Layer {
 public:
  // The mean of the distances to the source's surfaces.
  //   needed  if not null: the points that are known, among them those where the views differ and
  //           those around thin sheets
  Layer(const Grid& grid, LayerSource source, const PointBits* needed = nullptr);

  // The points inside. They include sheet points, which may lie outside of the liquid.
  const InsideBits& inside() const { return inside_; }
  // Thickness of the sheet in grid units at a point of a thin sheet (sheet_points.h); else 0.
  float SheetThickness(int i, int j, int k) const;
  // Whether one of rows j and j + 1 of planes k and k + 1 has a point of a thin sheet.
  bool HasSheetPoints(int j, int k) const;
  bool has_velocities() const;

  // The signed distance: never zero; about kBandWidth beyond the band; positive at sheet points
  // outside of the liquid.
  float Distance(int i, int j, int k) const;
  // Gradient of the distance: exact, also at sharp edges, where the distance is; zero beyond the
  // band.
  Eigen::Vector3f Gradient(int i, int j, int k) const;
  // Distances and gradients at the corners of a voxel.
  class Corners;
  Corners AtCorners(int i, int j, int k) const;
  // Velocity of the liquid at the surface point closest to this point; zero beyond the band.
  Eigen::Vector3f SurfaceVelocity(int i, int j, int k) const;

 private:
  struct Part {
    Part(const Grid& grid, LayerSource::View v, const PointBits* needed);
    float Distance(int i, int j, int k) const;
    Eigen::Vector3f Gradient(const DistanceBand::Entry& entry, bool is_inside) const;

    LayerSource::View view;
    DistanceBand band;
  };
  // Velocity at p from each part's triangle_of(part), if it is not -1.
  template <typename TriangleOf>
  Eigen::Vector3f MeanVelocity(const Eigen::Vector3f& p, TriangleOf&& triangle_of) const;
  void BlendInside(const Grid& grid);

  std::vector<Part> parts_;  // one or two
  InsideBits inside_;
  std::vector<SheetPoint> sheet_points_;
};

// Values of a layer, which must outlive it, at the corners of a voxel, numbered by their bits x, y,
// z.
class Layer::Corners {
 public:
  float Distance(int c) const { return distance_[c]; }
  Eigen::Vector3f Gradient(int c) const;
  // Velocity of the liquid at p near the voxel, metres per second.
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
