#include "liquidblend/decode.h"

#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>
#include <string>

#include "client/cli/files/mesh_stats.h"
#include "tests/client/fake_server.h"

namespace liquidblend {
namespace {

TEST(DecodeMesh, GivesBackAClosedMeshWithinTheGrid) {
  const Mesh original = testing::MakeOctahedron(0.5, 2.0);
  const auto mesh = DecodeMesh(testing::EncodeDraco(original, 14));
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  const cli::MeshStats stats = cli::ComputeMeshStats(*mesh);
  EXPECT_EQ(stats.num_vertices, 6);
  EXPECT_EQ(stats.num_triangles, 8);
  EXPECT_TRUE(stats.closed());
  constexpr double kGrid = 3.0 / (1 << 14);  // extent over 14 bits
  EXPECT_NEAR(stats.bounds.min.x, 0.5, kGrid);
  EXPECT_NEAR(stats.bounds.max.x, 3.5, kGrid);
  EXPECT_NEAR(stats.volume_m3, 4.0 / 3.0 * std::pow(1.5, 3), 0.01);
}

TEST(DecodeMesh, GivesBackNormalsAndVelocitiesWhereThereAreSome) {
  Mesh original = testing::MakeOctahedron(0.0, 0.0);
  const auto plain = DecodeMesh(testing::EncodeDraco(original, 14));
  ASSERT_TRUE(plain.ok()) << plain.status();
  EXPECT_TRUE(plain->normals.empty());
  EXPECT_TRUE(plain->velocities.empty());
  original.normals = original.positions;  // a unit octahedron around the origin
  for (const float x : original.positions) original.velocities.push_back(10 * x + 3);
  const auto mesh = DecodeMesh(testing::EncodeDraco(original, 14));
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ASSERT_EQ(mesh->normals.size(), mesh->positions.size());
  ASSERT_EQ(mesh->velocities.size(), mesh->positions.size());
  for (size_t i = 0; i < mesh->positions.size(); ++i) {
    EXPECT_NEAR(mesh->normals[i], mesh->positions[i], 0.01);
    EXPECT_NEAR(mesh->velocities[i], 10 * mesh->positions[i] + 3, 0.01);
  }
}

TEST(DecodeMesh, RefusesWhatIsNoDracoMesh) {
  EXPECT_EQ(DecodeMesh("").status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(DecodeMesh("hello").status().code(), absl::StatusCode::kInvalidArgument);
}

// Draco converts numbers of other types to floats, but a bool's byte may be neither 0 nor 1.
TEST(DecodeMesh, RefusesAttributesThatAreNoFloats) {
  draco::TriangleSoupMeshBuilder builder;
  builder.Start(1);
  const std::array<std::array<float, 3>, 3> corners = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}};
  const std::array<bool, 3> yes = {true, true, true};
  const int positions =
      builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
  const int normals = builder.AddAttribute(draco::GeometryAttribute::NORMAL, 3, draco::DT_BOOL);
  const draco::FaceIndex face(0);
  builder.SetAttributeValuesForFace(positions, face, corners[0].data(), corners[1].data(),
                                    corners[2].data());
  builder.SetAttributeValuesForFace(normals, face, yes.data(), yes.data(), yes.data());
  const std::unique_ptr<draco::Mesh> mesh = builder.Finalize();
  draco::EncoderBuffer buffer;
  ASSERT_TRUE(draco::Encoder().EncodeMeshToBuffer(*mesh, &buffer).ok());

  const absl::Status status = DecodeMesh(std::string(buffer.data(), buffer.size())).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(status.message(), ::testing::HasSubstr("instead of floats"));
}

TEST(DecodeMesh, ReportsEveryTruncationInsteadOfCrashing) {
  const std::string bytes = testing::EncodeDraco(testing::MakeOctahedron(0.0, 0.0), 14);
  for (size_t size = 0; size + 1 < bytes.size(); ++size) {
    EXPECT_FALSE(DecodeMesh(bytes.substr(0, size)).ok()) << size << " of " << bytes.size();
  }
}

}  // namespace
}  // namespace liquidblend
