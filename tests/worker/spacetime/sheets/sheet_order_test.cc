#include "worker/spacetime/sheets/sheet_order.h"

#include <gtest/gtest.h>

#include <cstring>

#include "tests/worker/spacetime/sheet_layers_testing.h"

namespace liquidblend::spacetime {
namespace {

// A vertex of the sheet's upper side outside of its cell, far from the rim, in slab 1.
const Slab::VertexBeyond& UpperVertex(const Slab& slab, const Grid& grid) {
  const Eigen::Vector3f middle = (-grid.origin_m / grid.spacing_m).cast<float>();
  for (const Slab::VertexBeyond& beyond : slab.beyond) {
    const Eigen::Vector3f offset = slab.vertices[beyond.vertex].head<3>() - middle;
    if (offset.head<2>().norm() < 2 && beyond.in_cell.z() > slab.vertices[beyond.vertex].z()) {
      return beyond;
    }
  }
  ADD_FAILURE() << "no vertex below its cell";
  return slab.beyond.front();
}

TEST(SheetOrder, LeavesAFlatSheetAsItIs) {
  Layers layers = SampleSheet({0, 0, 0});
  ASSERT_GT(layers.slabs[1].beyond.size(), 50U);
  EXPECT_EQ(KeepSheetOrder(parallel::Arena(2), layers), 0);
}

TEST(SheetOrder, DrawsBackWhatIsInsideOutAndLittleElse) {
  Layers layers = SampleSheet({0, 0, 0});
  Slab& slab = layers.slabs[1];
  const Slab::VertexBeyond upper = UpperVertex(slab, layers.grid);
  const std::vector<Eigen::Vector4f> before = slab.vertices;
  slab.vertices[upper.vertex].z() -= 3 * kSheetThickness;  // beneath the lower side
  const int64_t num_drawn = KeepSheetOrder(parallel::Arena(2), layers);
  EXPECT_GE(num_drawn, 1);
  EXPECT_LE(num_drawn, 30);
  EXPECT_GT(slab.vertices[upper.vertex].z(), before[upper.vertex].z() - 1.5f * kSheetThickness);
  for (int64_t v = 0; v < slab.num_vertices(); ++v) {
    if ((before[v] - before[upper.vertex]).head<3>().norm() < 3) continue;
    EXPECT_EQ(slab.vertices[v], before[v]);
  }
}

// Where nearly all of a sheet is inside out, what is left of it is drawn back as well.
TEST(SheetOrder, DrawsBackTheRestOfATornSheet) {
  Layers layers = SampleSheet({0, 0, 0});
  Slab& slab = layers.slabs[1];
  for (const Slab::VertexBeyond& beyond : slab.beyond) {
    Eigen::Vector4f& vertex = slab.vertices[beyond.vertex];
    if ((beyond.vertex & 3) == 0) continue;
    vertex.z() += beyond.in_cell.z() > vertex.z() ? -2.0f : 2.0f;
  }
  EXPECT_GT(KeepSheetOrder(parallel::Arena(2), layers), 0);
  int num_free = 0;
  for (const Slab::VertexBeyond& beyond : slab.beyond) {
    num_free += slab.vertices[beyond.vertex].head<3>() != beyond.in_cell;
  }
  EXPECT_LT(num_free, static_cast<int>(slab.beyond.size()) / 20);
}

TEST(SheetOrder, SameBytesAtAnyThreadCount) {
  const auto vertices_at = [](int num_threads) {
    Layers layers = SampleSheet({1.5f, 0.7f, 1.0f}, num_threads);
    EXPECT_GT(KeepSheetOrder(parallel::Arena(num_threads), layers), 0);
    return layers.slabs[1].vertices;
  };
  const auto one = vertices_at(1), eight = vertices_at(8);
  ASSERT_EQ(one.size(), eight.size());
  EXPECT_EQ(std::memcmp(one.data(), eight.data(), sizeof(one[0]) * one.size()), 0);
}

}  // namespace
}  // namespace liquidblend::spacetime
