#include "worker/registration/features/height_field.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/synthetic/shapes.h"
#include "tests/synthetic/turned.h"

namespace liquidblend::registration::height_field_test {
namespace {

constexpr mesh::HeightAxis kZ = {.axis = 2, .sign = 1};

mesh::TriangleMesh Block() { return synthetic::Box({-2, -1, -1}, {2, 1, 0.5}, 8); }

TEST(HeightField, IsTheTopOfABlockAndEndsAtItsSides) {
  const HeightField field(Block(), kZ, {0, 0}, 3, 0.25, Seen::kLargestPart);
  for (const double x : {-1.9, -0.3, 0.0, 1.7}) EXPECT_NEAR(field.At({x, 0.4}), 0.5, 1e-6) << x;
  EXPECT_TRUE(std::isnan(field.At({0, 1.3}))) << "beside it";
  EXPECT_TRUE(std::isnan(field.At({3.5, 0}))) << "outside of the grid";
  EXPECT_TRUE(std::isnan(field.At({1e12, -1e12})));
}

TEST(HeightField, SeesDetachedDropsOnlyIfAskedTo) {
  const mesh::TriangleMesh drop = synthetic::Icosphere({0, 0, 1.5f}, 0.4, 2);
  const mesh::TriangleMesh bubble = synthetic::Flipped(synthetic::Icosphere({1, 0, -0.3f}, 0.3, 2));
  const mesh::TriangleMesh parts[] = {drop, Block(), bubble};
  const HeightField field(synthetic::Join(parts), kZ, {0, 0}, 3, 0.25, Seen::kLargestPart);
  EXPECT_NEAR(field.At({0, 0}), 0.5, 1e-6);
  EXPECT_NEAR(field.At({1, 0}), 0.5, 1e-6);
  const HeightField all(synthetic::Join(parts), kZ, {0, 0}, 3, 0.25, Seen::kAll);
  EXPECT_NEAR(all.At({0, 0}), 1.9, 0.02);
}

TEST(HeightField, FollowsASlopeBetweenGridPoints) {
  mesh::TriangleMesh block = Block();
  for (int64_t v = 0; v < block.num_vertices(); ++v) {
    if (block.vertices(2, v) > 0) block.vertices(2, v) += 0.25f * block.vertices(0, v);
  }
  const HeightField field(block, kZ, {0, 0}, 3, 0.25, Seen::kLargestPart);
  for (const double x : {-1.6, -0.4, 0.1, 1.3}) {
    EXPECT_NEAR(field.At({x, 0.1}), 0.5 + 0.25 * x, 1e-5) << x;
  }
}

TEST(HeightField, LooksAgainstAnyUpwardDirection) {
  const Eigen::Vector3f place(0.7f, -0.4f, 0.5f);  // on the block's top
  for (const mesh::Up up : {mesh::Up::kX, mesh::Up::kY, mesh::Up::kZ, mesh::Up::kMinusX,
                            mesh::Up::kMinusY, mesh::Up::kMinusZ}) {
    const mesh::HeightAxis height = mesh::AxisOf(up);
    const Eigen::Vector3d turned = (synthetic::TurnTo(up) * place).cast<double>();
    const HeightField field(synthetic::Turned(Block(), up), height, PlaceOf(turned, height), 1,
                            0.25, Seen::kAll);
    EXPECT_NEAR(field.At(PlaceOf(turned, height)), 0.5, 1e-6) << mesh::NameOf(up);
    EXPECT_EQ(PointAt(PlaceOf(turned, height), 0.5, height), turned) << mesh::NameOf(up);
  }
}

}  // namespace
}  // namespace liquidblend::registration::height_field_test
