#include "client/cli/render/upright.h"

#include <gtest/gtest.h>

#include <array>
#include <utility>

namespace liquidblend::render {
namespace {

constexpr Up kAll[] = {Up::kX, Up::kY, Up::kZ, Up::kMinusX, Up::kMinusY, Up::kMinusZ};

std::array<float, 3> DirectionOf(Up up) {
  const int number = static_cast<int>(up) - 1;
  std::array<float, 3> direction = {};
  direction[static_cast<size_t>(number % 3)] = number < 3 ? 1.0f : -1.0f;
  return direction;
}

std::array<float, 3> Turned(float x, float y, float z, Up up) {
  Mesh mesh;
  mesh.positions = mesh.normals = mesh.velocities = {x, y, z};
  const Mesh turned = Upright(std::move(mesh), up);
  EXPECT_EQ(turned.normals, turned.positions);
  EXPECT_EQ(turned.velocities, turned.positions);
  return {turned.positions[0], turned.positions[1], turned.positions[2]};
}

TEST(Upright, TakesUpToZByARotation) {
  for (const Up up : kAll) {
    const auto [x, y, z] = DirectionOf(up);
    EXPECT_EQ(Turned(x, y, z, up), (std::array<float, 3>{0, 0, 1})) << NameOf(up);
    const auto a = Turned(1, 0, 0, up), b = Turned(0, 1, 0, up), c = Turned(0, 0, 1, up);
    const float determinant = a[0] * (b[1] * c[2] - b[2] * c[1]) -
                              a[1] * (b[0] * c[2] - b[2] * c[0]) +
                              a[2] * (b[0] * c[1] - b[1] * c[0]);
    EXPECT_EQ(determinant, 1) << NameOf(up);
  }
  EXPECT_EQ(Turned(1, 2, 3, Up::kUnknown), (std::array<float, 3>{1, 2, 3}));
  EXPECT_EQ(Turned(1, 2, 3, Up::kY), (std::array<float, 3>{1, -3, 2})) << "x stays to the right";
}

TEST(Upright, BoundsAreThoseOfTheTurnedCorners) {
  const Bounds bounds = {{-1, 2, -5}, {4, 3, 7}};
  for (const Up up : kAll) {
    const Bounds turned = Upright(bounds, up);
    const auto a = Turned(-1, 2, -5, up), b = Turned(4, 3, 7, up);
    EXPECT_EQ(turned.min.x, std::min(a[0], b[0])) << NameOf(up);
    EXPECT_EQ(turned.max.x, std::max(a[0], b[0])) << NameOf(up);
    EXPECT_EQ(turned.min.y, std::min(a[1], b[1])) << NameOf(up);
    EXPECT_EQ(turned.max.y, std::max(a[1], b[1])) << NameOf(up);
    EXPECT_EQ(turned.min.z, std::min(a[2], b[2])) << NameOf(up);
    EXPECT_EQ(turned.max.z, std::max(a[2], b[2])) << NameOf(up);
  }
}

}  // namespace
}  // namespace liquidblend::render
