#include "worker/registration/surface/cut_surface.h"

#include <gtest/gtest.h>

#include <functional>
#include <optional>

#include "tests/synthetic/shapes.h"

namespace liquidblend::registration::cut_surface_test {
namespace {

std::optional<mesh::TriangleMesh> Without(
    const mesh::TriangleMesh& surface, const std::function<bool(const Eigen::Vector3f&)>& is_cut) {
  CutSurface cut(surface);
  for (Eigen::Index v = 0; v < surface.num_vertices(); ++v) {
    if (is_cut(surface.vertices.col(v))) cut.Cut(v);
  }
  return cut.Close();
}

// A ball of radius 1 without its cap above z = 0.5, of volume 5/24 pi.
TEST(CutSurface, ClosesTheHoleWithAPlane) {
  mesh::TriangleMesh ball = synthetic::Icosphere({0, 0, 0}, 1.0, 4);
  ball.velocities = ball.vertices;
  const auto closed = Without(ball, [](const Eigen::Vector3f& p) { return p.z() > 0.5F; });
  ASSERT_TRUE(closed);
  EXPECT_TRUE(mesh::CheckClosed(*closed).closed());
  EXPECT_EQ(mesh::Validate(*closed), absl::OkStatus());
  EXPECT_NEAR(mesh::Volume(*closed), M_PI * (4.0 / 3 - 5.0 / 24), 0.1);
  EXPECT_LE(closed->vertices.row(2).maxCoeff(), 0.5F);
  EXPECT_LT((closed->velocities - closed->vertices).norm(), 1e-5F);
}

TEST(CutSurface, KeepsTheLargestPieceOfEachComponent) {
  const mesh::TriangleMesh parts[] = {synthetic::Icosphere({0, 0, 0}, 1.0, 4),
                                      synthetic::Icosphere({5, 0, 0}, 1.0, 3)};
  const mesh::TriangleMesh both = synthetic::Join(parts);
  const auto is_ring = [](const Eigen::Vector3f& p) {
    return p.x() < 2 && p.z() > 0.3F && p.z() < 0.6F;
  };
  const auto closed = Without(both, is_ring);
  ASSERT_TRUE(closed);
  EXPECT_TRUE(mesh::CheckClosed(*closed).closed());
  EXPECT_EQ(mesh::NumComponents(*closed), 2);
  for (Eigen::Index v = 0; v < closed->num_vertices(); ++v) {
    if (closed->vertices(0, v) < 2) {
      EXPECT_LE(closed->vertices(2, v), 0.3F);
    }
  }
}

TEST(CutSurface, CutsOffVerticesThatTwoRimsRunThrough) {
  const mesh::TriangleMesh ball = synthetic::Icosphere({0, 0, 0}, 1.0, 3);
  // Single vertices next to one another, so that rims meet.
  int num_closed = 0;
  for (int stride = 2; stride < 9; ++stride) {
    CutSurface cut(ball);
    for (Eigen::Index v = 0; v < ball.num_vertices() / 2; v += stride) cut.Cut(v);
    const auto closed = cut.Close();
    if (!closed) continue;
    ++num_closed;
    EXPECT_TRUE(mesh::CheckClosed(*closed).closed()) << stride;
    EXPECT_EQ(mesh::NumComponents(*closed), 1) << stride;
  }
  EXPECT_GT(num_closed, 0);
}

TEST(CutSurface, NothingIsLeftIfAllIsCutOff) {
  const mesh::TriangleMesh ball = synthetic::Icosphere({0, 0, 0}, 1.0, 2);
  EXPECT_FALSE(Without(ball, [](const Eigen::Vector3f&) { return true; }));
}

TEST(CutSurface, WithoutACutTheSurfaceStays) {
  const mesh::TriangleMesh ball = synthetic::Icosphere({0, 0, 0}, 1.0, 2);
  const auto closed = Without(ball, [](const Eigen::Vector3f&) { return false; });
  ASSERT_TRUE(closed);
  EXPECT_EQ(closed->vertices, ball.vertices);
  EXPECT_EQ(closed->triangles, ball.triangles);
}

}  // namespace
}  // namespace liquidblend::registration::cut_surface_test
