// Space-time surface nets: the dual of a grid in x, y, z, t. Internal to worker/spacetime.
//
// A layer is the grid at one time; a slab lies between the layers of two frames and is cut into
// steps, though not everywhere into equally many (slab_steps.h); a 4D cell is a voxel of one or
// several steps. Each 4D cell whose corners are not all inside or all outside has one vertex for
// each sheet of the surface in it; each grid edge whose ends differ (spatial: within a layer;
// temporal: between two layers) has one hexahedron, whose corners are the vertices of its sheets in
// the cells around. Where a cell goes on past a layer that its neighbours have, the corners before
// and after that layer coincide.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "core/mesh/space_time_mesh.h"
#include "worker/spacetime/field/grid.h"
#include "worker/spacetime/nets/layer.h"
#include "worker/spacetime/nets/slab_steps.h"

namespace liquidblend::spacetime {

// The mixed cells of one slab, sorted by (k, j, i, time), and their vertices in that order.
struct Slab {
  struct Cell {
    int32_t i;
    int32_t first_vertex;  // one per sheet
    uint16_t inside;       // bit c is set if corner c is inside
    uint8_t begin_layer;   // of the slab
    uint8_t end_layer;
    uint8_t num_sheets;
    bool is_cut;  // a cut cell (cut_cell.h), whose sheets do not follow from its corners
  };
  // A vertex that lies outside of its cell, next to a thin sheet.
  struct VertexBeyond {
    int64_t cell;
    int32_t vertex;
    Eigen::Vector3f in_cell;  // the nearest place in the cell
  };
  SlabSteps steps;
  std::vector<int64_t> row_begin;  // num_rows + 1: where each row of cells starts below
  std::vector<Cell> cells;
  std::vector<Eigen::Vector4f> vertices;    // grid units; t in [0, 1] within the slab
  std::vector<Eigen::Vector3f> velocities;  // metres per second; empty if not known
  std::vector<VertexBeyond> beyond;         // ascending
  int64_t num_cells() const { return static_cast<int64_t>(cells.size()); }
  int64_t num_vertices() const { return static_cast<int64_t>(vertices.size()); }
};

// The cell of a slab at voxel (i, j, k) that has the step after layer `step`; null if none is
// mixed.
const Slab::Cell* FindCell(const Grid& grid, const Slab& slab, int step, int i, int j, int k);

// The entry of a vertex that lies outside of its cell; null if it lies within.
const Slab::VertexBeyond* FindBeyond(const Slab& slab, int32_t vertex);

// The corners of cell (i, j, k) that are inside: bits x, y, z, t.
uint16_t InsideCorners(const InsideBits& earlier, const InsideBits& later, int i, int j, int k);

// Places the vertices of a slab, each where the tangent planes of its sheet of the surface near the
// cell's corners meet.
//   layers  steps.num_steps() + 1; those in between only need to be known around the blocks that
//           have them
//   motion  spacings that one metre per second covers from the first to the last of them
Slab PlaceVertices(const Grid& grid, std::span<const Layer* const> layers, SlabSteps steps = {},
                   float motion = 0);

// Input for the hexahedra of one slab.
struct SlabRef {
  const Slab* slab;
  int64_t first_vertex;  // of the slab in the whole mesh
  std::span<const InsideBits* const> layers;
};

// Hexahedra of the spatial edges in the layer that separates two slabs.
void AddSpatialHexahedra(const Grid& grid, const SlabRef& before, const SlabRef& after,
                         std::vector<mesh::Hexahedron>& hexahedra);

// Hexahedra of the temporal edges within one slab, and of the spatial edges in its layers in
// between.
void AddInnerHexahedra(const Grid& grid, const SlabRef& slab,
                       std::vector<mesh::Hexahedron>& hexahedra);

}  // namespace liquidblend::spacetime
