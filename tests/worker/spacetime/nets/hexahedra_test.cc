#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <span>

#include "core/mesh/space_time_mesh.h"
#include "worker/spacetime/nets/cell_sheets.h"
#include "worker/spacetime/nets/cut_cell.h"
#include "worker/spacetime/nets/surface_nets.h"

namespace liquidblend::spacetime::hexahedra_test {
namespace {

constexpr int kSide = 11;
constexpr int kNumSlabs = 4;

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

// Blocks cut at random into 1 to num_steps steps.
SlabSteps RandomSteps(const Grid& grid, int num_steps, std::mt19937& random) {
  SlabSteps steps(grid, num_steps);
  for (int k = 0; k < kSide; k += SlabSteps::kBlock) {
    for (int j = 0; j < kSide; j += SlabSteps::kBlock) {
      for (int i = 0; i < kSide; i += SlabSteps::kBlock) {
        int wanted = 1;
        while (wanted < num_steps && random() % 2 == 0) wanted *= 2;
        steps.Refine({i, j, k}, {i, j, k}, wanted);
      }
    }
  }
  return steps;
}

// A vertex for each sheet of each mixed cell of a slab, in the middle of the cell's time.
Slab MixedCells(const Grid& grid, const SlabSteps& steps,
                std::span<const InsideBits* const> layers) {
  Slab slab;
  slab.steps = steps;
  for (int k = 0; k < kSide; ++k) {
    for (int j = 0; j < kSide; ++j) {
      slab.row_begin.push_back(slab.num_cells());
      for (int i = 0; i + 1 < kSide && j + 1 < kSide && k + 1 < kSide; ++i) {
        const int span = steps.num_steps() / steps.OfVoxel(i, j, k);
        for (int l = 0; l < steps.num_steps(); l += span) {
          const uint16_t inside = InsideCorners(*layers[l], *layers[l + span], i, j, k);
          const bool is_cut = steps.IsBesideFiner(i, j, k);
          const int num_sheets = is_cut ? FindSheets(GatherCutCell(steps, layers, i, j, k, l)).count
                                        : NumSheets(inside);
          if (num_sheets == 0) continue;
          slab.cells.push_back({i, static_cast<int32_t>(slab.num_vertices()), inside,
                                static_cast<uint8_t>(l), static_cast<uint8_t>(l + span),
                                static_cast<uint8_t>(num_sheets), is_cut});
          const float time = (static_cast<float>(l) + 0.5f * static_cast<float>(span)) /
                             static_cast<float>(steps.num_steps());
          for (int n = 0; n < num_sheets; ++n) slab.vertices.push_back({0, 0, 0, time});
        }
      }
    }
  }
  slab.row_begin.push_back(slab.num_cells());
  EXPECT_EQ(static_cast<int64_t>(slab.row_begin.size()), grid.num_rows() + 1);
  return slab;
}

// Slabs of random fields, the inner ones cut into num_steps steps where it happens.
mesh::SpaceTimeMesh RandomMesh(int num_steps, std::mt19937& random) {
  Grid grid;
  grid.dims = {kSide, kSide, kSide};
  std::vector<InsideBits> layers;
  for (int l = 0; l < 3 + (kNumSlabs - 2) * num_steps; ++l) {
    layers.push_back(RandomBits(grid, random));
  }
  std::vector<const InsideBits*> inside;
  for (const InsideBits& layer : layers) inside.push_back(&layer);
  std::vector<Slab> slabs(kNumSlabs);
  std::vector<SlabRef> refs;
  int64_t num_vertices = 0;
  for (size_t s = 0, l = 0; s < kNumSlabs; ++s) {
    const bool at_end = s == 0 || s + 1 == kNumSlabs;
    const SlabSteps steps = at_end ? SlabSteps() : RandomSteps(grid, num_steps, random);
    refs.push_back({&slabs[s], num_vertices, std::span(inside).subspan(l, steps.num_steps() + 1)});
    slabs[s] = MixedCells(grid, steps, refs.back().layers);
    num_vertices += slabs[s].num_vertices();
    l += steps.num_steps();
  }
  mesh::SpaceTimeMesh mesh;
  mesh.vertices.resize(4, num_vertices);
  for (size_t s = 0; s < kNumSlabs; ++s) {
    if (s > 0) AddSpatialHexahedra(grid, refs[s - 1], refs[s], mesh.hexahedra);
    AddInnerHexahedra(grid, refs[s], mesh.hexahedra);
    for (int64_t n = 0; n < slabs[s].num_vertices(); ++n) {
      mesh.vertices.col(refs[s].first_vertex + n) = slabs[s].vertices[n];
      mesh.vertices(3, refs[s].first_vertex + n) += static_cast<float>(s) - 1.0f;
    }
  }
  mesh.num_frames = kNumSlabs - 1;
  mesh.num_first_vertices = slabs.front().num_vertices();
  mesh.num_last_vertices = slabs.back().num_vertices();
  mesh.edge_length_m = 1;
  return mesh;
}

// The strongest form of the claim: any field at all, however noisy, gives a closed complex.
TEST(Hexahedra, OfAnyFieldAreClosedAndOriented) {
  std::mt19937 random(7);
  for (int trial = 0; trial < 20; ++trial) {
    const absl::Status valid = mesh::Validate(RandomMesh(1, random));
    EXPECT_TRUE(valid.ok()) << valid;
  }
}

TEST(Hexahedra, AreClosedWhereNeighboursAreCutIntoDifferentSteps) {
  std::mt19937 random(7);
  for (const int num_steps : {2, 4, 8}) {
    for (int trial = 0; trial < 10; ++trial) {
      const mesh::SpaceTimeMesh mesh = RandomMesh(num_steps, random);
      const absl::Status valid = mesh::Validate(mesh);
      EXPECT_TRUE(valid.ok()) << num_steps << " steps: " << valid;
    }
  }
}

TEST(Hexahedra, AreFlatOnlyWhereACellGoesOnPastALayer) {
  std::mt19937 random(7);
  const auto is_flat = [](const mesh::Hexahedron& cell) {
    return cell[0] == cell[4] || cell[1] == cell[5] || cell[2] == cell[6] || cell[3] == cell[7];
  };
  const mesh::SpaceTimeMesh uncut = RandomMesh(1, random), cut = RandomMesh(4, random);
  EXPECT_TRUE(std::none_of(uncut.hexahedra.begin(), uncut.hexahedra.end(), is_flat));
  const auto num_flat = std::count_if(cut.hexahedra.begin(), cut.hexahedra.end(), is_flat);
  EXPECT_GT(num_flat, 0);
  EXPECT_LT(num_flat, static_cast<int64_t>(cut.hexahedra.size()) / 2);
}

}  // namespace
}  // namespace liquidblend::spacetime::hexahedra_test
