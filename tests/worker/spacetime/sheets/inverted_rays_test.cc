#include "worker/spacetime/sheets/inverted_rays.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <tuple>

#include "tests/worker/spacetime/sheet_layers_testing.h"

namespace liquidblend::spacetime {
namespace {

std::vector<char> All(const BoxFaces& boxes) { return std::vector<char>(boxes.before.size(), 1); }

// In no particular order.
std::vector<std::tuple<float, float, float>> Sorted(const Eigen::Matrix3Xf& places) {
  std::vector<std::tuple<float, float, float>> sorted;
  for (const auto& place : places.colwise()) sorted.emplace_back(place.x(), place.y(), place.z());
  std::sort(sorted.begin(), sorted.end());
  return sorted;
}

// Corners whose vertices, before or after, are flagged.
std::vector<char> CornersOf(const BoxFaces& boxes,
                            const std::vector<std::vector<char>>& is_flagged) {
  std::vector<char> flags(boxes.before.size(), 0);
  for (const auto* corners : {&boxes.before, &boxes.after}) {
    for (size_t c = 0; c < corners->size(); ++c) {
      const BoxCorner& corner = (*corners)[c];
      if (corner.vertex >= 0 && is_flagged[corner.slab][corner.vertex] != 0) flags[c] = 1;
    }
  }
  return flags;
}

TEST(InvertedRays, FindNothingInAFlatSheet) {
  const Layers layers = SampleSheet({0, 0, 0});
  const std::vector<BoxFaces> boxes = FindBoxFaces(layers, parallel::Arena(2));
  ASSERT_FALSE(boxes.empty());
  for (const BoxFaces& of_layer : boxes) {
    InvertedRays rays(layers, of_layer);
    rays.Update(layers, All(of_layer));
    EXPECT_EQ(rays.Places().cols(), 0);
  }
}

// However vertices move, a few at a time, rays that are looked at again find what all of them
// would.
TEST(InvertedRays, UpdatesFindWhatNewRaysFind) {
  Layers layers = SampleSheet({1.5f, 0.7f, 1.0f});
  std::mt19937 random(1);
  for (Slab& slab : layers.slabs) {  // to where both sides of the sheet are through each other
    for (Slab::VertexBeyond& beyond : slab.beyond) {
      if (random() % 3 != 0) continue;
      beyond.in_cell.z() += beyond.in_cell.z() > slab.vertices[beyond.vertex].z() ? -2.5f : 2.5f;
    }
  }
  std::vector<InvertedRays> rays;
  for (BoxFaces& boxes : FindBoxFaces(layers, parallel::Arena(2))) {
    rays.emplace_back(layers, boxes).Update(layers, All(boxes));
  }
  int64_t num_before = 0, num_after = 0;
  for (const InvertedRays& of_layer : rays) num_before += of_layer.Places().cols();
  for (int round = 0; round < 16; ++round) {
    const unsigned one_of = round % 2 == 0 ? 8 : 200;  // many rays, or hardly any
    std::vector<std::vector<char>> has_moved;
    for (Slab& slab : layers.slabs) {
      std::vector<char>& of_slab = has_moved.emplace_back(slab.vertices.size(), 0);
      for (const Slab::VertexBeyond& beyond : slab.beyond) {
        if (random() % one_of != 0) continue;
        Eigen::Vector4f& vertex = slab.vertices[beyond.vertex];
        vertex.head<3>() += 0.5f * (beyond.in_cell - vertex.head<3>());
        of_slab[beyond.vertex] = 1;
      }
    }
    num_after = 0;
    for (InvertedRays& of_layer : rays) {
      of_layer.Update(layers, CornersOf(of_layer.boxes(), has_moved));
      InvertedRays anew(layers, of_layer.boxes());
      anew.Update(layers, All(of_layer.boxes()));
      EXPECT_EQ(Sorted(of_layer.Places()), Sorted(anew.Places()));
      num_after += of_layer.Places().cols();
    }
  }
  EXPECT_GT(num_after, num_before + 1000);
}

}  // namespace
}  // namespace liquidblend::spacetime
