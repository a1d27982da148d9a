#include <gtest/gtest.h>

#include <random>

#include "core/mesh/space_time_mesh.h"
#include "worker/spacetime/cell_sheets.h"
#include "worker/spacetime/surface_nets.h"

namespace liquidblend::spacetime {
namespace {

constexpr int kSide = 7;
constexpr int kNumLayers = 5;

// Points inside at random, none at the border of the grid.
InsideBits RandomBits(const Grid& grid, std::mt19937& random) {
  InsideBits bits(grid);
  for (int k = 1; k + 1 < kSide; ++k) {
    for (int j = 1; j + 1 < kSide; ++j) {
      for (int i = 1; i + 1 < kSide; ++i) {
        if (random() % 2 == 0) bits.MutableRow(grid.Row(j, k))[0] |= uint64_t{1} << i;
      }
    }
  }
  return bits;
}

// A vertex for each sheet of each mixed cell between two layers, all in the same place.
Slab MixedCells(const Grid& grid, const InsideBits& earlier, const InsideBits& later) {
  Slab slab;
  for (int k = 0; k < kSide; ++k) {
    for (int j = 0; j < kSide; ++j) {
      slab.row_begin.push_back(slab.num_cells());
      for (int i = 0; i + 1 < kSide && j + 1 < kSide && k + 1 < kSide; ++i) {
        const uint16_t inside = InsideCorners(earlier, later, i, j, k);
        if (NumSheets(inside) == 0) continue;
        slab.cell_i.push_back(i);
        slab.cell_inside.push_back(inside);
        slab.first_vertex.push_back(static_cast<int32_t>(slab.num_vertices()));
        slab.vertices.insert(slab.vertices.end(), NumSheets(inside),
                             Eigen::Vector4i(i, j, k, 0).cast<float>());
      }
    }
  }
  slab.row_begin.push_back(slab.num_cells());
  EXPECT_EQ(static_cast<int64_t>(slab.row_begin.size()), grid.num_rows() + 1);
  return slab;
}

// The strongest form of the claim: any field at all, however noisy, gives a closed complex.
TEST(Hexahedra, OfAnyFieldAreClosedAndOriented) {
  std::mt19937 random(7);
  Grid grid;
  grid.dims = {kSide, kSide, kSide};
  for (int trial = 0; trial < 20; ++trial) {
    std::vector<InsideBits> layers;
    for (int l = 0; l < kNumLayers; ++l) layers.push_back(RandomBits(grid, random));
    std::vector<Slab> slabs;
    std::vector<int64_t> first = {0};
    for (int s = 0; s + 1 < kNumLayers; ++s) {
      slabs.push_back(MixedCells(grid, layers[s], layers[s + 1]));
      first.push_back(first.back() + slabs.back().num_vertices());
    }
    mesh::SpaceTimeMesh mesh;
    for (int s = 0; s + 1 < kNumLayers; ++s) {
      const SlabRef slab{&slabs[s], first[s]};
      if (s > 0) {
        AddSpatialHexahedra(grid, layers[s], {&slabs[s - 1], first[s - 1]}, slab, mesh.hexahedra);
      }
      AddTemporalHexahedra(grid, layers[s], layers[s + 1], slab, mesh.hexahedra);
    }
    mesh.vertices.resize(4, first.back());
    for (int s = 0; s + 1 < kNumLayers; ++s) {
      for (int64_t n = 0; n < slabs[s].num_vertices(); ++n) {
        mesh.vertices.col(first[s] + n) = slabs[s].vertices[n];
        mesh.vertices(3, first[s] + n) = static_cast<float>(s) - 0.5f;
      }
    }
    mesh.num_frames = kNumLayers - 2;
    mesh.num_first_vertices = slabs.front().num_vertices();
    mesh.num_last_vertices = slabs.back().num_vertices();
    mesh.edge_length_m = 1;
    const absl::Status valid = mesh::Validate(mesh);
    EXPECT_TRUE(valid.ok()) << valid;
  }
}

}  // namespace
}  // namespace liquidblend::spacetime
