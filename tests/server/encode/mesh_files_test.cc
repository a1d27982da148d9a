#include "server/encode/mesh_files.h"

#include <gtest/gtest.h>

#include <span>

#include "core/mesh/triangle_mesh.h"
#include "tests/synthetic/shapes.h"
#include "worker/ingest/formats/readers.h"

namespace liquidblend::encode {
namespace {

std::span<const std::byte> AsBytes(const std::string& text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

mesh::TriangleMesh Ball() {
  mesh::TriangleMesh mesh = synthetic::Icosphere({0.1f, -2.0f, 1e-7f}, 0.3, 2);
  mesh.velocities = 3.7f * mesh.vertices;
  mesh.normals = mesh.vertices.colwise().normalized();
  return mesh;
}

TEST(EncodePly, IsReadBackToTheLastBit) {
  const mesh::TriangleMesh ball = Ball();
  const std::string bytes = EncodePly(ball);
  const auto read = ingest::ReadPly(AsBytes(bytes));
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->vertices, ball.vertices);
  EXPECT_EQ(read->velocities, ball.velocities);
  EXPECT_EQ(read->triangles, ball.triangles);
  EXPECT_NE(bytes.find("property float nz"), std::string::npos);
}

TEST(EncodeObj, IsReadBackToTheLastBit) {
  mesh::TriangleMesh ball = Ball();
  for (const bool has_normals : {true, false}) {
    if (!has_normals) ball.normals.resize(3, 0);
    const std::string text = EncodeObj(ball);
    const auto read = ingest::ReadObj(AsBytes(text));
    ASSERT_TRUE(read.ok()) << read.status();
    EXPECT_EQ(read->vertices, ball.vertices);
    EXPECT_EQ(read->triangles, ball.triangles);
    EXPECT_EQ(text.find("\nvn ") != std::string::npos, has_normals);
  }
}

TEST(MeshFiles, LeaveOutTrianglesWithAVertexTwice) {
  mesh::TriangleMesh ball = Ball();
  const int64_t num_triangles = ball.num_triangles();
  ball.triangles.col(3) = Eigen::Vector3i(7, 7, 2);
  EXPECT_EQ(ingest::ReadPly(AsBytes(EncodePly(ball)))->num_triangles(), num_triangles - 1);
  EXPECT_EQ(ingest::ReadObj(AsBytes(EncodeObj(ball)))->num_triangles(), num_triangles - 1);
}

TEST(MeshFiles, MayBeEmpty) {
  const mesh::TriangleMesh nothing;
  EXPECT_EQ(ingest::ReadPly(AsBytes(EncodePly(nothing)))->num_vertices(), 0);
  EXPECT_EQ(EncodeObj(nothing), "");
}

}  // namespace
}  // namespace liquidblend::encode
