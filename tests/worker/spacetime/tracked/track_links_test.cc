#include "worker/spacetime/tracked/track_links.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <numeric>
#include <random>
#include <vector>

#include "core/mesh/animation.h"
#include "tests/synthetic/shapes.h"
#include "tests/synthetic/tracked.h"
#include "worker/spacetime/field/frame_topology.h"

namespace liquidblend::spacetime {
namespace {

using mesh::TriangleMesh;

FrameLinks Link(const TriangleMesh& earlier, const TriangleMesh& later) {
  return LinkFrames(earlier, later,
                    {.step_s = 1.0 / 24, .edge_length_m = mesh::MeanEdgeLength(earlier)});
}

std::vector<int32_t> Numbers(int64_t count) {
  std::vector<int32_t> numbers(count);
  std::iota(numbers.begin(), numbers.end(), 0);
  return numbers;
}

// Vertex v becomes vertex to[v].
TriangleMesh Renumbered(TriangleMesh mesh, const std::vector<int32_t>& to) {
  const TriangleMesh old = mesh;
  for (int64_t v = 0; v < old.num_vertices(); ++v) {
    mesh.vertices.col(to[v]) = old.vertices.col(v);
    mesh.velocities.col(to[v]) = old.velocities.col(v);
  }
  for (int& v : mesh.triangles.reshaped()) v = to[v];
  return mesh;
}

TEST(LinkFrames, FollowsVerticesThatWereRenumbered) {
  const mesh::Animation animation = synthetic::SphereToEllipsoid();
  std::vector<int32_t> to = Numbers(animation.frames[1].num_vertices());
  std::shuffle(to.begin(), to.end(), std::mt19937_64(1));
  const FrameLinks links = Link(animation.frames[0], Renumbered(animation.frames[1], to));
  EXPECT_EQ(links.vertex, to);
  EXPECT_EQ(links.num_matched, animation.frames[0].num_triangles());
}

TEST(LinkFrames, FollowsNumbersThatMoveOnByOne) {
  // Most index triples of a grid are those of other triangles after such a shift.
  TriangleMesh torus = synthetic::Torus({0, 0, 0}, 1.0, 0.4, 40, 16);
  torus.velocities = Eigen::Matrix3Xf::Zero(3, torus.num_vertices());
  std::vector<int32_t> to = Numbers(torus.num_vertices());
  std::rotate(to.begin(), to.begin() + 1, to.end());
  EXPECT_EQ(Link(torus, Renumbered(torus, to)).vertex, to);
}

TEST(LinkFrames, OfEqualTriangleListsNeedNoVelocities) {
  const TriangleMesh sphere = synthetic::Icosphere({0, 0, 0}, 1.0, 3);
  const TriangleMesh far = synthetic::Icosphere({3, 0, 0}, 1.0, 3);
  const FrameLinks links = Link(sphere, far);
  EXPECT_EQ(links.vertex, Numbers(sphere.num_vertices()));
  EXPECT_EQ(links.num_matched, sphere.num_triangles());
}

TEST(LinkFrames, TrustNumbersOfMostlyEqualListsWithoutVelocities) {
  synthetic::RemeshingOptions options;
  options.splits_per_frame = 0;
  options.collapses_per_frame = 0;
  mesh::Animation flips = synthetic::RemeshedEllipsoid(options);
  const auto edge = static_cast<float>(mesh::MeanEdgeLength(flips));
  for (int k = 0; k < 2; ++k) flips.frames[k].velocities.resize(3, 0);
  flips.frames[1].vertices.row(0).array() += 0.8f * edge;
  const FrameLinks links = Link(flips.frames[0], flips.frames[1]);
  EXPECT_EQ(links.vertex, Numbers(flips.frames[0].num_vertices()));
  EXPECT_EQ(links.num_matched, flips.frames[0].num_triangles() - 2 * options.flips_per_frame);
}

TEST(LinkFrames, TakesTheVelocitiesOfOneFrame) {
  const mesh::Animation animation = synthetic::MovingSphere();
  const std::vector<int32_t> to = [&] {
    std::vector<int32_t> reversed = Numbers(animation.frames[1].num_vertices());
    std::reverse(reversed.begin(), reversed.end());
    return reversed;
  }();
  TriangleMesh without = animation.frames[0];
  without.velocities.resize(3, 0);
  EXPECT_EQ(Link(without, Renumbered(animation.frames[1], to)).vertex, to);
  TriangleMesh later = Renumbered(animation.frames[1], to);
  later.velocities.resize(3, 0);
  EXPECT_EQ(Link(animation.frames[0], later).vertex, to);
}

TEST(LinkFrames, DoesNotLinkABodyThatVanishesToTheOneAboveIt) {
  const TriangleMesh upper = synthetic::Box({0, 0, 0.13f}, {1, 1, 0.23f}, 10);
  const TriangleMesh lower = synthetic::Box({0, 0, 0}, {1, 1, 0.1f}, 10);
  const FrameLinks links = Link(synthetic::Join(std::array{lower, upper}), upper);
  for (int64_t v = 0; v < lower.num_vertices(); ++v) EXPECT_EQ(links.vertex[v], -1) << v;
  EXPECT_EQ(links.num_matched, upper.num_triangles());
}

TEST(LinkFrames, JoinsTwoVerticesOnlyWhereAnEdgeCollapsed) {
  synthetic::RemeshingOptions options;
  options.flips_per_frame = 0;
  options.splits_per_frame = 0;
  const mesh::Animation animation = synthetic::RemeshedEllipsoid(options);
  const TriangleMesh& earlier = animation.frames[0];
  const FrameLinks links = Link(earlier, animation.frames[1]);
  const FrameTopology topology(earlier);
  std::map<int32_t, std::vector<int32_t>> linked;
  for (int32_t v = 0; v < earlier.num_vertices(); ++v) linked[links.vertex[v]].push_back(v);
  EXPECT_EQ(linked.count(-1), 0u);
  int num_joined = 0;
  for (const auto& [to, from] : linked) {
    if (from.size() == 1) continue;
    ASSERT_EQ(from.size(), 2u);
    EXPECT_TRUE(topology.Opposite(from[0], from[1]) >= 0);
    ++num_joined;
  }
  EXPECT_EQ(num_joined, earlier.num_vertices() - animation.frames[1].num_vertices());
  EXPECT_GT(num_joined, 3);
}

TEST(LinkFrames, MeetsNoTriangleTwiceAndNoneThatRunsTheOtherWay) {
  const mesh::Animation animation = synthetic::ReplacedEllipsoid();
  const TriangleMesh& earlier = animation.frames[3];
  const TriangleMesh& later = animation.frames[4];
  const FrameLinks links = Link(earlier, later);
  const FrameTopology topology(later);
  std::map<int32_t, int> times_met;
  for (int64_t t = 0; t < earlier.num_triangles(); ++t) {
    if (links.triangle[t] < 0) continue;
    EXPECT_EQ(++times_met[links.triangle[t]], 1);
    const Corners c = CornersOf(earlier, t);
    EXPECT_EQ(topology.Find({links.vertex[c[0]], links.vertex[c[1]], links.vertex[c[2]]}),
              links.triangle[t]);
  }
  EXPECT_EQ(static_cast<int64_t>(times_met.size()), links.num_matched);
  EXPECT_GT(links.num_matched, 0);
}

TEST(FrameTopology, MeasuresAlongTheSurface) {
  // Through a thin plate the two sides are near, around it they are not.
  const TriangleMesh plate = synthetic::Box({0, 0, 0}, {1, 1, 0.02f}, 10);
  int32_t above = -1;
  int32_t below = -1;
  for (int32_t v = 0; v < plate.num_vertices(); ++v) {
    if ((plate.vertices.col(v) - Eigen::Vector3f(0.5f, 0.5f, 0.02f)).norm() < 1e-3f) above = v;
    if ((plate.vertices.col(v) - Eigen::Vector3f(0.5f, 0.5f, 0)).norm() < 1e-3f) below = v;
  }
  const FrameTopology topology(plate);
  EXPECT_FALSE(topology.IsNear(above, below, 0.9f));
  EXPECT_TRUE(topology.IsNear(above, below, 1.1f));
  EXPECT_TRUE(topology.IsNear(above, above, 0.01f));
}

}  // namespace
}  // namespace liquidblend::spacetime
