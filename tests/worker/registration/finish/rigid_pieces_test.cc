#include "worker/registration/finish/rigid_pieces.h"

#include <gmock/gmock.h>

#include "tests/worker/registration/registration_testing.h"
#include "worker/registration/register.h"

namespace liquidblend::registration {
namespace {

TEST(CarryRigidPieces, MovesEachWithTheSurfaceAroundIt) {
  const TestSurface source(BuildMesh(BlockAndDroplet(0), kDropletVertices));
  ASSERT_EQ(source.mesh.rigid_pieces.size(), 13u);
  const Eigen::Vector4f move(0.5f, -1.0f, 2.0f, 0.25f);
  Points displacement = Points::Zero(4, source.mesh.num_vertices());
  for (const int32_t v : source.surface.FreeVertices()) displacement.col(v) = move;
  CarryRigidPieces(source.surface, parallel::Arena(2), displacement);
  EXPECT_TRUE(displacement.isApprox(move.replicate(1, displacement.cols()), 1e-5f));
}

// The field turns time round; a droplet's own time still goes on.
TEST(CarryRigidPieces, TimeGoesOnAlongADroplet) {
  const TestSurface source(BuildMesh(BlockAndDroplet(0), kDropletVertices));
  Points displacement = Points::Zero(4, source.mesh.num_vertices());
  for (const int32_t v : source.surface.FreeVertices()) {
    displacement(3, v) = -2 * source.surface.points(3, v);
  }
  CarryRigidPieces(source.surface, parallel::Arena(2), displacement);
  const auto& pieces = source.mesh.rigid_pieces;
  ASSERT_EQ(pieces.size(), 13u);
  for (size_t n = 1; n < pieces.size(); ++n) {
    const auto time = [&](const mesh::RigidPiece& piece) {
      return source.surface.points(3, piece.first_vertex) + displacement(3, piece.first_vertex);
    };
    EXPECT_GT(time(pieces[n]), time(pieces[n - 1])) << n;
  }
}

TEST(CarryRigidPieces, RegistrationKeepsTheShapeOfDroplets) {
  const mesh::SpaceTimeMesh source = BuildMesh(BlockAndDroplet(0), kDropletVertices);
  const mesh::SpaceTimeMesh target = BuildMesh(BlockAndDroplet(0.3f), kDropletVertices);
  RegistrationOptions options;
  options.max_iterations = 6;
  const auto result = Register(source, target, {}, options, parallel::Arena(2));
  ASSERT_TRUE(result.ok()) << result.status();
  ASSERT_EQ(source.rigid_pieces.size(), 13u);
  for (const mesh::RigidPiece& piece : source.rigid_pieces) {
    for (const Eigen::Matrix4Xf* field : {&result->displacement, &result->extrapolation}) {
      const auto moves = field->middleCols(piece.first_vertex, piece.num_vertices);
      EXPECT_TRUE((moves.colwise() - moves.col(0)).isZero(0)) << piece.first_vertex;
    }
  }
  EXPECT_GT(result->displacement.row(2).maxCoeff(), 0.2f);
}

TEST(CarryRigidPieces, DropletsAloneCannotBeRegistered) {
  mesh::Animation droplet;
  droplet.frames.assign(3, synthetic::Icosphere({0, 0, 0}, 0.15, 1));
  const mesh::SpaceTimeMesh mesh = BuildMesh(droplet, kDropletVertices);
  const auto result = Register(mesh, mesh, {}, {}, parallel::Arena(1));
  EXPECT_THAT(result.status().message(), ::testing::HasSubstr("nothing but droplets"));
}

}  // namespace
}  // namespace liquidblend::registration
