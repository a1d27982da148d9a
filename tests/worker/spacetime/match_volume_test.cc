#include "worker/spacetime/match_volume.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace liquidblend::spacetime::match_volume_test {
namespace {

using Eigen::Vector3d;

struct Box {
  Vector3d low;
  double side;
  double volume() const { return side * side * side; }
  mesh::Component Whole() const {
    return {low + Vector3d::Constant(side / 2), volume(), 6 * side * side};
  }
};

const Box kPool = {{0, 0, 0}, 1.0};
const Box kDrop = {{0.3, 0.3, 1.2}, 0.4};

// Boxes that stay as they are from time 0 to 1, a hexahedron a side.
mesh::SpaceTimeMesh MeshOf(const std::vector<Box>& boxes) {
  mesh::SpaceTimeMesh mesh;
  const auto num_vertices = static_cast<Eigen::Index>(16 * boxes.size());
  mesh.vertices.resize(4, num_vertices);
  mesh.normals = Eigen::Matrix4Xf::Zero(4, num_vertices);
  mesh.edge_length_m = 0.25;
  mesh.num_frames = 2;
  for (size_t n = 0; n < boxes.size(); ++n) {
    const auto first = static_cast<int32_t>(16 * n);
    for (int32_t corner = 0; corner < 16; ++corner) {  // bits: x, y, z, t
      const Vector3d at(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
      const Vector3d place = boxes[n].low + boxes[n].side * at;
      const Vector3d outward = (at - Vector3d::Constant(0.5)).normalized();
      mesh.vertices.col(first + corner) << place.cast<float>(), static_cast<float>(corner >> 3);
      mesh.normals.col(first + corner).head<3>() = outward.cast<float>();
    }
    for (int axis = 0; axis < 3; ++axis) {
      for (const int32_t side : {0, 1}) {
        // Corner a + 2 b: the normal is b x a.
        const int a = (axis + (side == 1 ? 2 : 1)) % 3, b = 3 - axis - a;
        mesh::Hexahedron hexahedron;
        for (int32_t c = 0; c < 8; ++c) {
          hexahedron[c] =
              first + (side << axis) + ((c & 1) << a) + ((c >> 1 & 1) << b) + (c >> 2 << 3);
        }
        mesh.hexahedra.push_back(hexahedron);
      }
    }
  }
  return mesh;
}

// Of each box, in the order given, once the slice at 0.5 has been given the frame's parts.
std::vector<double> Matched(const std::vector<Box>& boxes,
                            const std::vector<mesh::Component>& parts, int num_threads = 2) {
  mesh::SpaceTimeMesh mesh = MeshOf(boxes);
  const std::vector<FrameHexahedra> frames = {{0.5, parts, mesh.hexahedra}};
  MatchVolumes(frames, parallel::Arena(num_threads), mesh);
  std::vector<double> volumes;
  for (size_t n = 0; n < boxes.size(); ++n) {
    const auto corners = mesh.vertices.middleCols(static_cast<Eigen::Index>(16 * n), 16);
    volumes.push_back((corners.rowwise().maxCoeff() - corners.rowwise().minCoeff())
                          .head<3>()
                          .cast<double>()
                          .prod());
  }
  return volumes;
}

mesh::Component Larger(const Box& box, double factor) {
  mesh::Component part = box.Whole();
  part.volume *= factor;
  return part;
}

TEST(MatchVolumes, GivesEachPartItsOwn) {
  const std::vector<double> volumes =
      Matched({kPool, kDrop}, {Larger(kDrop, 1.05), Larger(kPool, 0.98)});
  EXPECT_NEAR(volumes[0], 0.98 * kPool.volume(), 1e-3);
  EXPECT_NEAR(volumes[1], 1.05 * kDrop.volume(), 1e-4);
}

TEST(MatchVolumes, IsTheSameForAnyThreadCount) {
  const std::vector<mesh::Component> parts = {Larger(kPool, 0.98), Larger(kDrop, 1.05)};
  const std::vector<double> one = Matched({kPool, kDrop}, parts, 1);
  for (const int num_threads : {2, 8}) EXPECT_EQ(Matched({kPool, kDrop}, parts, num_threads), one);
}

TEST(MatchVolumes, LeavesWhatWouldHaveToMoveTooFar) {
  const std::vector<double> volumes =
      Matched({kPool, kDrop}, {Larger(kPool, 1.25), Larger(kDrop, 1.05)});
  EXPECT_NEAR(volumes[0], kPool.volume(), 1e-6);
  EXPECT_NEAR(volumes[1], 1.05 * kDrop.volume(), 1e-4);
}

TEST(MatchVolumes, APartThatIsElsewhereIsAnother) {
  Box moved = kDrop;
  moved.low.x() += 1;
  const std::vector<double> volumes = Matched({kPool, kDrop}, {kPool.Whole(), Larger(moved, 1.05)});
  // All that has no partner is taken together: the same here.
  EXPECT_NEAR(volumes[1], 1.05 * kDrop.volume(), 1e-4);
  EXPECT_NEAR(volumes[0], kPool.volume(), 1e-6);
}

TEST(MatchVolumes, WhatHasMetInTheFrameAloneIsTakenTogether) {
  mesh::Component met = kPool.Whole();
  met.volume = 1.01 * (kPool.volume() + kDrop.volume());
  const std::vector<double> volumes = Matched({kPool, kDrop}, {met});
  EXPECT_NEAR(volumes[0] + volumes[1], met.volume, 1e-3);
  EXPECT_LT(volumes[0], 1.02 * kPool.volume()) << "the drop's volume twice";
}

TEST(MatchVolumes, WhatHasMetInTheSliceAloneIsTakenTogether) {
  const Box met = {{0, 0, 0}, std::cbrt(kPool.volume() + kDrop.volume())};
  const std::vector<double> volumes = Matched({met}, {kPool.Whole(), kDrop.Whole()});
  EXPECT_NEAR(volumes[0], kPool.volume() + kDrop.volume(), 1e-3) << "without the drop's volume";
}

}  // namespace
}  // namespace liquidblend::spacetime::match_volume_test
