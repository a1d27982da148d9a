// Space-time surface nets: the dual of a grid in x, y, z, t. Internal to worker/spacetime.
//
// A layer is the grid at one time; a slab lies between two layers; a 4D cell is a voxel of a slab.
// Each 4D cell whose 16 corners are not all inside or all outside has one vertex for each sheet of
// the surface in it; each grid edge whose ends differ (spatial: within a layer; temporal: between
// two layers) has one hexahedron, whose corners are the vertices of its sheets in the cells around.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/mesh/space_time_mesh.h"
#include "worker/spacetime/grid.h"
#include "worker/spacetime/layer.h"

namespace liquidblend::spacetime {

// The mixed cells of one slab, sorted by (k, j, i), and their vertices in that order.
struct Slab {
  std::vector<int64_t> row_begin;           // num_rows + 1: where each row of cells starts below
  std::vector<int32_t> cell_i;              // per cell
  std::vector<uint16_t> cell_inside;        // per cell: bit c is set if corner c is inside
  std::vector<int32_t> first_vertex;        // per cell, one per sheet
  std::vector<Eigen::Vector4f> vertices;    // grid units; t in [0, 1] within the slab
  std::vector<Eigen::Vector3f> velocities;  // metres per second; empty if not known
  int64_t num_cells() const { return static_cast<int64_t>(cell_i.size()); }
  int64_t num_vertices() const { return static_cast<int64_t>(vertices.size()); }
};

// The corners of cell (i, j, k) that are inside: bits x, y, z, t.
uint16_t InsideCorners(const InsideBits& earlier, const InsideBits& later, int i, int j, int k);

// Places the vertices between two layers, each where the planes that touch its sheet of the surface
// near the cell's corners meet.
Slab PlaceVertices(const Grid& grid, const Layer& earlier, const Layer& later);

// What the hexahedra of one step in time need: the layer between two slabs.
struct SlabRef {
  const Slab* slab;
  int64_t first_vertex;  // of the slab in the whole mesh
};

// Hexahedra of the spatial edges in the layer that separates two slabs.
void AddSpatialHexahedra(const Grid& grid, const InsideBits& layer, const SlabRef& before,
                         const SlabRef& after, std::vector<mesh::Hexahedron>& hexahedra);

// Hexahedra of the temporal edges within one slab.
void AddTemporalHexahedra(const Grid& grid, const InsideBits& earlier, const InsideBits& later,
                          const SlabRef& slab, std::vector<mesh::Hexahedron>& hexahedra);

}  // namespace liquidblend::spacetime
