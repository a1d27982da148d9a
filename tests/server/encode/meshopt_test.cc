// Encoder and the clients' decoder.
#include "server/encode/meshopt.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/finish/normals.h"
#include "liquidblend/decode.h"
#include "liquidblend/v1/liquidblend.pb.h"
#include "tests/server/encode/encode_testing.h"
#include "tests/synthetic/shapes.h"

namespace liquidblend::encode {
namespace {

frames::RoundingOptions RoundingWith(int position_bits) {
  frames::RoundingOptions options;
  options.grid = OptionsWith(position_bits).grid;
  options.position_bits = position_bits;
  options.duration_s = 2.0;
  return options;
}

mesh::TriangleMesh SphereWithAttributes() {
  mesh::TriangleMesh sphere = synthetic::Icosphere({0.1F, 0.2F, 0.3F}, 1.0, 4);
  finish::AddNormals(sphere);
  sphere.velocities = 3.0F * sphere.vertices;
  sphere.rest.resize(4, sphere.num_vertices());
  sphere.rest.topRows<3>() = 0.5F * sphere.vertices;
  sphere.rest.row(3).setConstant(1.5F);
  return sphere;
}

mesh::TriangleMesh ToTriangleMesh(const Mesh& decoded) {
  mesh::TriangleMesh mesh;
  mesh.vertices = Eigen::Map<const Eigen::Matrix3Xf>(
      decoded.positions.data(), 3, static_cast<Eigen::Index>(decoded.num_vertices()));
  mesh.triangles =
      Eigen::Map<const Eigen::Matrix<uint32_t, 3, Eigen::Dynamic>>(
          decoded.triangles.data(), 3, static_cast<Eigen::Index>(decoded.num_triangles()))
          .cast<int>();
  return mesh;
}

TEST(EncodeMeshopt, HasTheTrianglesAndTheGridOfDraco) {
  for (const mesh::TriangleMesh& surface : {synthetic::Icosphere({0.1F, 0.2F, 0.3F}, 1.0, 4),
                                            synthetic::Torus({0, 0, 0}, 1.0, 0.3, 64, 32)}) {
    for (const int bits : {8, 14, 16}) {
      const auto data = EncodeMeshopt(surface, RoundingWith(bits));
      ASSERT_TRUE(data.ok()) << data.status();
      const auto decoded = DecodeMesh(*data);
      ASSERT_TRUE(decoded.ok()) << decoded.status();
      const auto draco = EncodeDraco(surface, OptionsWith(bits));
      ASSERT_TRUE(draco.ok()) << draco.status();
      EXPECT_EQ(NodesOf(ToTriangleMesh(*decoded), OptionsWith(bits)),
                NodesOf(Decode(*draco), OptionsWith(bits)));
    }
  }
}

TEST(EncodeMeshopt, GivesBackAttributes) {
  const mesh::TriangleMesh sphere = SphereWithAttributes();
  const auto data = EncodeMeshopt(sphere, RoundingWith(14));
  ASSERT_TRUE(data.ok()) << data.status();
  const auto decoded = DecodeMesh(*data);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  ASSERT_EQ(decoded->normals.size(), decoded->positions.size());
  ASSERT_EQ(decoded->velocities.size(), decoded->positions.size());
  ASSERT_EQ(decoded->rest.size(), 4 * decoded->num_vertices());
  for (size_t v = 0; v < decoded->num_vertices(); ++v) {
    const Eigen::Map<const Eigen::Vector3f> position(&decoded->positions[3 * v]),
        normal(&decoded->normals[3 * v]), velocity(&decoded->velocities[3 * v]);
    const Eigen::Map<const Eigen::Vector4f> rest(&decoded->rest[4 * v]);
    EXPECT_NEAR(normal.norm(), 1.0, 1e-5);
    EXPECT_NEAR((normal - (position - Eigen::Vector3f(0.1F, 0.2F, 0.3F))).norm(), 0.0, 0.01);
    EXPECT_NEAR((velocity - 3 * position).norm(), 0.0, 0.002);
    EXPECT_NEAR((rest.head<3>() - 0.5 * position).norm(), 0.0, 5e-4);
    EXPECT_NEAR(rest[3], 1.5, 1e-4);
  }
}

TEST(EncodeMeshopt, GivesBackAMeshOfNothing) {
  const auto data = EncodeMeshopt({}, RoundingWith(14));
  ASSERT_TRUE(data.ok()) << data.status();
  const auto decoded = DecodeMesh(*data);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(decoded->num_vertices(), 0u);
  EXPECT_EQ(decoded->num_triangles(), 0u);
}

TEST(EncodeMeshopt, RefusesBitsThatItDoesNotHave) {
  for (const int bits : {7, 17}) {
    const auto data = EncodeMeshopt(synthetic::Icosphere({0, 0, 0}, 1.0, 1), RoundingWith(bits));
    EXPECT_EQ(data.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(data.status().message()), testing::HasSubstr("position_bits"));
  }
}

TEST(DecodeMeshopt, ReportsDamageInsteadOfCrashing) {
  const std::string data = *EncodeMeshopt(SphereWithAttributes(), RoundingWith(14));
  for (size_t size = 0; size < data.size(); size += 97) {
    EXPECT_FALSE(DecodeMesh(data.substr(0, size)).ok()) << size << " of " << data.size();
  }
  // Any outcome but a crash or a mesh whose triangles leave it.
  for (size_t at = 0; at < data.size(); at += 61) {
    std::string changed = data;
    changed[at] = static_cast<char>(changed[at] ^ 0x55);
    const auto decoded = DecodeMesh(changed);
    if (!decoded.ok()) continue;
    for (const uint32_t v : decoded->triangles) ASSERT_LT(v, decoded->num_vertices()) << at;
  }
}

TEST(DecodeMeshopt, GivesNoMemoryToCountsThatTheBytesCannotHold) {
  v1::MeshoptMesh message;
  ASSERT_TRUE(message.ParseFromString(
      *EncodeMeshopt(synthetic::Icosphere({0, 0, 0}, 1.0, 1), RoundingWith(14))));
  v1::MeshoptMesh vertices = message, triangles = message;
  vertices.set_num_vertices(0xFFFFFFFF);
  triangles.set_num_triangles(0xFFFFFFFF);
  for (const v1::MeshoptMesh& claim : {vertices, triangles}) {
    EXPECT_EQ(DecodeMesh(claim.SerializeAsString()).status().code(), absl::StatusCode::kDataLoss);
  }
}

TEST(DecodeMeshopt, RefusesNumbersThatAreNotFinite) {
  v1::MeshoptMesh message;
  ASSERT_TRUE(message.ParseFromString(*EncodeMeshopt(SphereWithAttributes(), RoundingWith(14))));
  const auto refuses = [&](auto change) {
    v1::MeshoptMesh changed = message;
    change(changed);
    const absl::Status status = DecodeMesh(changed.SerializeAsString()).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
    EXPECT_THAT(std::string(status.message()), testing::HasSubstr("not finite"));
  };
  refuses([](auto& mesh) { mesh.set_step_m(NAN); });
  refuses([](auto& mesh) { mesh.set_step_m(1e35F); });  // times 65535
  refuses([](auto& mesh) { mesh.set_origin_m(1, INFINITY); });
  refuses([](auto& mesh) { mesh.set_velocity_step_m_s(-INFINITY); });
  refuses([](auto& mesh) { mesh.set_rest_step_m(NAN); });
  refuses([](auto& mesh) { mesh.set_rest_origin_s(NAN); });
}

}  // namespace
}  // namespace liquidblend::encode
