#include "worker/spacetime/sheets/liquid_boxes.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <map>
#include <numbers>

#include "tests/worker/spacetime/sheet_layers_testing.h"

namespace liquidblend::spacetime {
namespace {

// At the end of the boxes' time.
Eigen::Vector3f PlaceOf(const Layers& layers, const BoxCorner& corner) {
  return corner.vertex < 0
             ? Eigen::Vector3f(corner.place.head<3>())
             : Eigen::Vector3f(layers.slabs[corner.slab].vertices[corner.vertex].head<3>());
}

class LiquidBoxes : public testing::TestWithParam<Eigen::Vector3f> {};

TEST_P(LiquidBoxes, AreClosedAroundASheet) {
  const Layers layers = SampleSheet(GetParam());
  const std::vector<BoxFaces> all = FindBoxFaces(layers, parallel::Arena(2));
  ASSERT_EQ(all.size(), layers.inside.size() - 2);  // all layers but the first and the last
  for (const BoxFaces& boxes : all) {
    ASSERT_EQ(boxes.before.size(), boxes.after.size());
    ASSERT_FALSE(boxes.faces.empty()) << boxes.layer;
    std::map<std::pair<int, int>, int> count;
    for (const auto& face : boxes.faces) {
      for (int c = 0; c < 4; ++c) {
        const int a = face[c], b = face[(c + 1) % 4];
        count[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
      }
    }
    for (const auto& [edge, sum] : count) EXPECT_EQ(sum, 0) << boxes.layer;
  }
}

TEST_P(LiquidBoxes, HaveTheVolumeOfASheet) {
  const Layers layers = SampleSheet(GetParam());
  const double volume = std::numbers::pi * kSheetRadius * kSheetRadius * kSheetThickness;
  const std::vector<BoxFaces> all = FindBoxFaces(layers, parallel::Arena(2));
  ASSERT_EQ(all.size(), layers.inside.size() - 2);
  for (const BoxFaces& boxes : all) {
    double sum = 0;
    for (const auto& face : boxes.faces) {
      std::array<Eigen::Vector3d, 4> p;
      for (int c = 0; c < 4; ++c) p[c] = PlaceOf(layers, boxes.after[face[c]]).cast<double>();
      sum += (p[0].dot(p[1].cross(p[2])) + p[0].dot(p[2].cross(p[3]))) / 6;
    }
    EXPECT_NEAR(sum / volume, 1, 0.08) << boxes.layer;
  }
}

INSTANTIATE_TEST_SUITE_P(AtSpeeds, LiquidBoxes,
                         testing::Values(Eigen::Vector3f(0, 0, 0),
                                         Eigen::Vector3f(0.1f, 0.2f, 0.4f),
                                         Eigen::Vector3f(1.5f, 0.7f, 1.0f)));

}  // namespace
}  // namespace liquidblend::spacetime
