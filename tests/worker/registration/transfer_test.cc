#include "worker/registration/transfer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/worker/registration/registration_testing.h"

namespace liquidblend::registration::transfer_test {
namespace {

mesh::Animation Ball() {
  synthetic::MovingSphereOptions options;
  options.subdivisions = 4;
  return synthetic::MovingSphere(options);
}

mesh::SpaceTimeMesh MeshOf(const mesh::Animation& animation, double spacing) {
  spacetime::BuildOptions options;
  options.connectivity = spacetime::Connectivity::kRebuilt;
  options.spacing_edges *= spacing;
  auto mesh = spacetime::Build(animation, options, parallel::Arena(2));
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  return *std::move(mesh);
}

// Waves of half a metre and eight frames.
Eigen::Matrix4Xf SmoothField(const mesh::SpaceTimeMesh& mesh) {
  Eigen::Matrix4Xf field(4, mesh.num_vertices());
  for (int64_t v = 0; v < mesh.num_vertices(); ++v) {
    const Eigen::Vector4f p = mesh.vertices.col(v);
    field.col(v) << 0.1F * std::sin(4 * p.x()), 0.1F * std::cos(4 * p.y()), 0.2F * p.z(),
        2.0F * std::sin(0.8F * p.w());
  }
  return field;
}

// Piece n moves as nothing else does.
float FieldOfPiece(size_t n) { return 10.0F + static_cast<float>(n); }

TEST(Transfer, CoarserGridsHaveAHalfAndAQuarterOfTheVertices) {
  const mesh::Animation ball = Ball();
  const auto fine = static_cast<double>(MeshOf(ball, 1.0).num_vertices());
  const auto half = static_cast<double>(MeshOf(ball, std::numbers::sqrt2).num_vertices());
  const auto quarter = static_cast<double>(MeshOf(ball, 2.0).num_vertices());
  EXPECT_NEAR(half / fine, 0.5, 0.08);
  EXPECT_NEAR(quarter / fine, 0.25, 0.06);
}

TEST(Transfer, ASmoothFieldStaysTheSame) {
  const mesh::Animation ball = Ball();
  const mesh::SpaceTimeMesh fine = MeshOf(ball, 1.0);
  const mesh::SpaceTimeMesh coarse = MeshOf(ball, 2.0);
  const parallel::Arena arena(2);
  const Eigen::Matrix4Xf moved =
      Transfer(TransferSource(fine, arena), coarse, arena).Apply(SmoothField(fine), arena);
  const Eigen::Matrix4Xf error = moved - SmoothField(coarse);
  const auto edge_m = static_cast<float>(fine.edge_length_m);
  EXPECT_LT(error.topRows<3>().colwise().norm().mean(), 0.05F * edge_m);
  EXPECT_LT(error.row(3).cwiseAbs().mean(), 0.2F);  // frames, of a field that changes by 1.6 in one
}

TEST(Transfer, OntoItselfGivesAlmostTheSameAndConstantsExactly) {
  const mesh::SpaceTimeMesh mesh = SphereMesh();
  const parallel::Arena arena(2);
  const Transfer transfer(TransferSource(mesh, arena), mesh, arena);
  const Eigen::Matrix4Xf field = SmoothField(mesh);
  EXPECT_LT((transfer.Apply(field, arena) - field).topRows<3>().cwiseAbs().mean(), 2e-3F);
  const Eigen::Matrix4Xf constant = Eigen::Matrix4Xf::Constant(4, mesh.num_vertices(), 0.5F);
  EXPECT_LT((transfer.Apply(constant, arena) - constant).cwiseAbs().maxCoeff(), 1e-5F);
  EXPECT_EQ(transfer.Apply(Eigen::Matrix4Xf(), arena).cols(), 0);
}

TEST(Transfer, DropletsStayRigidAndMoveAsTheSameOnes) {
  const mesh::Animation animation = BlockAndDroplet(0);
  const mesh::SpaceTimeMesh fine = MeshOf(animation, 1.0);
  const mesh::SpaceTimeMesh coarse = MeshOf(animation, 2.0);
  ASSERT_FALSE(fine.rigid_pieces.empty());
  ASSERT_EQ(coarse.rigid_pieces.size(), fine.rigid_pieces.size());
  Eigen::Matrix4Xf field = SmoothField(fine);
  for (size_t n = 0; n < fine.rigid_pieces.size(); ++n) {
    const mesh::RigidPiece& piece = fine.rigid_pieces[n];
    field.middleCols(piece.first_vertex, piece.num_vertices).setConstant(FieldOfPiece(n));
  }
  const parallel::Arena arena(2);
  const Eigen::Matrix4Xf moved =
      Transfer(TransferSource(fine, arena), coarse, arena).Apply(field, arena);
  const std::vector<char> is_rigid = mesh::RigidVertices(coarse);
  for (size_t n = 0; n < coarse.rigid_pieces.size(); ++n) {
    const mesh::RigidPiece& piece = coarse.rigid_pieces[n];
    const auto moves = moved.middleCols(piece.first_vertex, piece.num_vertices);
    EXPECT_TRUE((moves.array() == FieldOfPiece(n)).all()) << n;
  }
  for (int64_t v = 0; v < coarse.num_vertices(); ++v) {
    if (is_rigid[v]) continue;
    ASSERT_LT(moved.col(v).cwiseAbs().maxCoeff(), 5.0F) << v;
  }
}

TEST(Transfer, TheOtherSideOfAThinSheetDoesNotCount) {
  // Two layers of vertices, a twentieth of an edge apart, that look away from each other.
  mesh::SpaceTimeMesh sheet;
  sheet.edge_length_m = 1.0;
  sheet.vertices.resize(4, 50);
  sheet.normals = Eigen::Matrix4Xf::Zero(4, 50);
  Eigen::Matrix4Xf side = Eigen::Matrix4Xf::Zero(4, 50);
  for (int v = 0; v < 50; ++v) {
    const bool is_upper = v >= 25;
    sheet.vertices.col(v) << static_cast<float>(v % 5), static_cast<float>(v / 5 % 5),
        is_upper ? 0.05F : 0.0F, 0.0F;
    sheet.normals(2, v) = is_upper ? 1.0F : -1.0F;
    side(0, v) = is_upper ? 1.0F : -1.0F;
  }
  const parallel::Arena arena(1);
  const Eigen::Matrix4Xf moved =
      Transfer(TransferSource(sheet, arena), sheet, arena).Apply(side, arena);
  EXPECT_LT((moved - side).cwiseAbs().maxCoeff(), 1e-6F);
}

TEST(Transfer, GivesTheSameBytesForAnyThreadCount) {
  const mesh::Animation ball = Ball();
  const mesh::SpaceTimeMesh fine = MeshOf(ball, 1.0);
  const mesh::SpaceTimeMesh coarse = MeshOf(ball, 2.0);
  const Eigen::Matrix4Xf field = SmoothField(fine);
  const parallel::Arena one(1);
  const Eigen::Matrix4Xf expected =
      Transfer(TransferSource(fine, one), coarse, one).Apply(field, one);
  for (const int num_threads : {2, 8}) {
    const parallel::Arena arena(num_threads);
    const Eigen::Matrix4Xf moved =
        Transfer(TransferSource(fine, arena), coarse, arena).Apply(field, arena);
    EXPECT_TRUE(moved == expected) << num_threads;
  }
}

}  // namespace
}  // namespace liquidblend::registration::transfer_test
