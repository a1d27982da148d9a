#include "client/cli/render/water.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <utility>

#include "client/cli/files/mesh_stats.h"
#include "tests/client/fake_server.h"

namespace liquidblend::render {
namespace {

using ::testing::HasSubstr;

WaterOptions Small() {
  WaterOptions options;
  options.width = 64;
  options.height = 48;
  options.samples_per_side = 2;
  return options;
}

// Blue less red: liquid is blue, the studio nearly grey.
int Blueness(const Image& image, int x, int y) {
  const size_t pixel = 3 * static_cast<size_t>(y * image.width + x);
  return image.rgb[pixel + 2] - image.rgb[pixel];
}

TEST(RenderWater, ShowsTheLiquidInTheMiddleOfAnEvenBackdrop) {
  const Mesh mesh = testing::MakeOctahedron(0.0, 0.0);
  const auto image = RenderWater(mesh, cli::ComputeMeshStats(mesh).bounds, Small());
  ASSERT_TRUE(image.ok()) << image.status();
  EXPECT_EQ(image->width, 64);
  EXPECT_EQ(image->height, 48);
  EXPECT_GT(Blueness(*image, 32, 24), Blueness(*image, 2, 2) + 30);
  const std::set<uint8_t> values(image->rgb.begin(), image->rgb.end());
  EXPECT_GT(values.size(), 50u) << "shaded, not flat";
}

TEST(RenderWater, GivesTheSameBytesEveryTime) {
  const Mesh mesh = testing::MakeOctahedron(0.0, 0.0);
  const Bounds bounds = cli::ComputeMeshStats(mesh).bounds;
  EXPECT_EQ(RenderWater(mesh, bounds, Small())->rgb, RenderWater(mesh, bounds, Small())->rgb);
}

TEST(RenderWater, DoesNotShowLiquidWithinLiquid) {
  const Mesh outer = testing::MakeOctahedron(0.0, 0.0);
  Mesh nested = outer;
  for (const float x : outer.positions) nested.positions.push_back(0.5f * x);
  for (const uint32_t v : outer.triangles) {
    nested.triangles.push_back(v + static_cast<uint32_t>(outer.num_vertices()));
  }
  const Bounds bounds = cli::ComputeMeshStats(outer).bounds;
  Mesh bubble = nested;
  for (size_t t = outer.triangles.size(); t < bubble.triangles.size(); t += 3) {
    std::swap(bubble.triangles[t], bubble.triangles[t + 1]);
  }
  EXPECT_EQ(RenderWater(nested, bounds, Small())->rgb, RenderWater(outer, bounds, Small())->rgb);
  EXPECT_NE(RenderWater(bubble, bounds, Small())->rgb, RenderWater(outer, bounds, Small())->rgb);
}

TEST(RenderWater, FramesTheBoundsNotTheMesh) {
  const Mesh mesh = testing::MakeOctahedron(0.0, 0.0);
  Bounds wide = cli::ComputeMeshStats(mesh).bounds;
  wide.max.x += 6.0;
  const auto image = RenderWater(mesh, wide, Small());
  ASSERT_TRUE(image.ok());
  int left = 0;
  int right = 0;
  for (int y = 0; y < image->height; ++y) {
    for (int x = 0; x < image->width; ++x) {
      (x < image->width / 2 ? left : right) += Blueness(*image, x, y) > 60;
    }
  }
  EXPECT_GT(left, 10);
  EXPECT_EQ(right, 0);
}

TEST(RenderWater, AnEmptyMeshIsAnEmptyStudio) {
  const Bounds bounds{{-1, -1, -1}, {1, 1, 1}};
  const auto image = RenderWater(Mesh(), bounds, Small());
  ASSERT_TRUE(image.ok()) << image.status();
  EXPECT_LT(Blueness(*image, 32, 24), 60);
}

TEST(RenderWater, NamesAnOptionOutOfRange) {
  WaterOptions options = Small();
  options.camera.elevation_deg = 90.0;
  EXPECT_THAT(RenderWater(Mesh(), {}, options).status().ToString(),
              HasSubstr("camera elevation is 90"));
  options = Small();
  options.width = 0;
  EXPECT_THAT(RenderWater(Mesh(), {}, options).status().ToString(), HasSubstr("width is 0"));
}

}  // namespace
}  // namespace liquidblend::render
