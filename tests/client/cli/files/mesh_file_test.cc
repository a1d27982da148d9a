#include "client/cli/files/mesh_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "client/cli/files/mesh_stats.h"
#include "tests/client/fake_server.h"
#include "tests/client/temp_files.h"
#include "tests/paths.h"

namespace liquidblend::cli {
namespace {

using ::testing::HasSubstr;
using testing::TempDir;

Mesh AwkwardOctahedron() {
  Mesh mesh = testing::MakeOctahedron(0.1, 1.0 / 3.0);
  mesh.positions[0] = 1.0e-30f;
  mesh.positions[4] = -123456.789f;
  return mesh;
}

std::string Unzip(const std::string& bytes) {
  std::string raw(1 << 20, '\0');
  z_stream stream{};
  inflateInit2(&stream, 15 + 16);
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(raw.data());
  stream.avail_out = static_cast<uInt>(raw.size());
  EXPECT_EQ(inflate(&stream, Z_FINISH), Z_STREAM_END);
  raw.resize(stream.total_out);
  inflateEnd(&stream);
  return raw;
}

TEST(MeshFile, EveryFormatGivesBackTheSameNumbers) {
  const TempDir dir;
  const Mesh mesh = AwkwardOctahedron();
  for (const char* name : {"m.ply", "m.obj", "fluid_mesh_0001.bobj.gz", "UPPER.PLY"}) {
    ASSERT_TRUE(WriteMeshFile(mesh, dir.File(name)).ok()) << name;
    const auto read = ReadMeshFile(dir.File(name));
    ASSERT_TRUE(read.ok()) << read.status();
    EXPECT_EQ(read->positions, mesh.positions) << name;
    EXPECT_EQ(read->triangles, mesh.triangles) << name;
  }
  EXPECT_EQ(dir.List().size(), 4u) << "no .part files are left";
}

TEST(MeshFile, BobjHasMantaflowsLayoutWithOutwardUnitNormals) {
  const Mesh mesh = testing::MakeOctahedron(0.0, 0.0);
  const auto bytes = ToBobj(mesh);
  ASSERT_TRUE(bytes.ok());
  const std::string raw = Unzip(*bytes);
  ASSERT_EQ(raw.size(), 4u + 72 + 4 + 72 + 4 + 96);
  const auto int_at = [&](size_t offset) {
    int32_t value = 0;
    std::memcpy(&value, &raw[offset], 4);
    return value;
  };
  EXPECT_EQ(int_at(0), 6);
  EXPECT_EQ(int_at(76), 6);
  EXPECT_EQ(int_at(152), 8);
  float normal[3];
  std::memcpy(normal, &raw[80], sizeof(normal));  // of the vertex at +x
  EXPECT_NEAR(normal[0], 1.0f, 1e-6);
  EXPECT_NEAR(normal[1], 0.0f, 1e-6);
}

TEST(MeshFile, StlHasTheCornersOfEachTriangleAndItsNormal) {
  const Mesh mesh = testing::MakeOctahedron(0.0, 0.0);
  const std::string bytes = ToStl(mesh);
  ASSERT_EQ(bytes.size(), 80U + 4 + 50 * 8);
  EXPECT_NE(bytes.substr(0, 5), "solid") << "which begins ASCII files";
  EXPECT_EQ(bytes.substr(80, 4), std::string("\x08\x00\x00\x00", 4));
  float first[12];
  std::memcpy(first, &bytes[84], sizeof(first));
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(first[k], 1 / std::sqrt(3.0), 1e-6);
  for (size_t k = 0; k < 9; ++k) {
    EXPECT_EQ(first[3 + k], mesh.positions[3 * mesh.triangles[k / 3] + k % 3]);
  }
}

TEST(MeshFile, ReadsARealMantaflowFrame) {
  const auto mesh = ReadMeshFile(paths::Source("tests/data/two_drops/A/fluid_mesh_0018.bobj.gz"));
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  const MeshStats stats = ComputeMeshStats(*mesh);
  EXPECT_EQ(stats.num_vertices, 5730);
  EXPECT_EQ(stats.num_triangles, 11456);
  EXPECT_TRUE(stats.closed());
  EXPECT_GT(stats.volume_m3, 0.0);
}

TEST(MeshFile, PlySkipsMoreFloatsPerVertex) {
  const float vertices[3][6] = {{0, 0, 0, 9, 9, 9}, {1, 0, 0, 9, 9, 9}, {0, 1, 0, 9, 9, 9}};
  std::string bytes =
      "ply\r\nformat binary_little_endian 1.0\r\ncomment x\r\nelement vertex 3\r\n"
      "property float x\r\nproperty float y\r\nproperty float z\r\nproperty float vx\r\n"
      "property float vy\r\nproperty float vz\r\nelement face 1\r\n"
      "property list uchar uint vertex_index\r\nend_header\n";
  bytes.append(reinterpret_cast<const char*>(vertices), sizeof(vertices));
  const uint32_t triangle[] = {0, 1, 2};
  bytes += '\3';
  bytes.append(reinterpret_cast<const char*>(triangle), sizeof(triangle));
  const auto mesh = FromPly(bytes, "m.ply");
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->positions, (std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0}));
}

TEST(MeshFile, PlyHoldsNormalsAndVelocities) {
  Mesh mesh;
  mesh.positions = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  mesh.triangles = {0, 1, 2};
  mesh.normals = {0, 0, 1, 0, 0, 1, 0, 0, 1};
  mesh.velocities = {1, 2, 3, 4, 5, 6, 7, 8, 9};
  const std::string bytes = ToPly(mesh);
  EXPECT_THAT(bytes, HasSubstr("property float z\nproperty float nx\nproperty float ny\n"
                               "property float nz\nproperty float vx\nproperty float vy\n"
                               "property float vz\nelement face 1\n"));
  const float second[] = {1, 0, 0, 0, 0, 1, 4, 5, 6};
  const size_t data = bytes.find("end_header\n") + 11;
  EXPECT_EQ(std::memcmp(&bytes[data + sizeof(second)], second, sizeof(second)), 0);
  const auto read = FromPly(bytes, "m.ply");
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->positions, mesh.positions);
  EXPECT_EQ(read->triangles, mesh.triangles);
  EXPECT_EQ(read->normals, mesh.normals);
  EXPECT_EQ(read->velocities, mesh.velocities);
}

TEST(MeshFile, BobjKeepsTheNormalsOfTheMesh) {
  Mesh mesh = testing::MakeOctahedron(0.0, 0.0);
  mesh.normals.assign(mesh.positions.size(), 0.5f);
  const auto read = FromBobj(*ToBobj(mesh), "m.bobj.gz");
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->normals, mesh.normals);
}

TEST(MeshFile, NamesWhatItPassesOver) {
  std::string passed_over = "before";
  ASSERT_TRUE(FromPly(ToPly(testing::MakeOctahedron(0, 0)), "m.ply", &passed_over).ok());
  EXPECT_EQ(passed_over, "");
  const float vertex[] = {1, 2, 3, 7, 4, 5, 6, 8, 9};
  const std::string data(reinterpret_cast<const char*>(vertex), sizeof(vertex));
  std::string header = "ply\nformat binary_little_endian 1.0\nelement vertex 1\n";
  for (const char* name : {"x", "y", "z", "u", "vx", "vy", "vz", "nx", "ny"}) {
    header += std::string("property float ") + name + "\n";
  }
  const auto mesh = FromPly(header + "end_header\n" + data, "m.ply", &passed_over);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->velocities, (std::vector<float>{4, 5, 6}));
  EXPECT_TRUE(mesh->normals.empty());
  EXPECT_EQ(passed_over, "u, nx, ny");
  const std::string obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//1\n";
  ASSERT_TRUE(FromObj(obj, "m.obj", &passed_over).ok());
  EXPECT_EQ(passed_over, "normals");
  ASSERT_TRUE(FromObj("vt 0 0\n" + obj, "m.obj", &passed_over).ok());
  EXPECT_EQ(passed_over, "normals and texture coordinates");
}

TEST(MeshFile, RefusesWhatItCannotReadWithTheReason) {
  const TempDir dir;
  const auto refusal = [&](const std::string& name, const std::string& bytes) {
    return ReadMeshFile(dir.Write(name, bytes)).status().ToString();
  };
  EXPECT_THAT(refusal("a.stl", "solid"), HasSubstr("a.stl: not a mesh file by its name"));
  EXPECT_THAT(refusal("a.ply", "ply\nformat ascii 1.0\nend_header\n"), HasSubstr("format ascii"));
  EXPECT_THAT(refusal("b.ply", "no"), HasSubstr("not a PLY file"));
  EXPECT_THAT(refusal("a.obj", "v 0 0 0\nf 1 1 1 1\n"), HasSubstr("line 2"));
  EXPECT_THAT(refusal("b.obj", "v 0 zero 0\n"), HasSubstr("line 1"));
  EXPECT_THAT(refusal("a.bobj.gz", "plain"), HasSubstr("not gzip"));
  EXPECT_THAT(refusal("a.drc", "plain"), HasSubstr("a.drc: neither a Draco mesh"));
  EXPECT_THAT(ReadMeshFile(dir.File("none.ply")).status().ToString(), HasSubstr("none.ply"));
}

TEST(MeshFile, ReportsEveryTruncation) {
  const Mesh mesh = testing::MakeOctahedron(0.0, 0.0);
  const std::string ply = ToPly(mesh);
  for (size_t size = 0; size < ply.size(); ++size) {
    EXPECT_FALSE(FromPly(ply.substr(0, size), "m").ok()) << size;
  }
  const std::string bobj = *ToBobj(mesh);
  for (size_t size = 0; size < bobj.size(); ++size) {
    EXPECT_FALSE(FromBobj(bobj.substr(0, size), "m").ok()) << size;
  }
}

TEST(MeshFile, NamesABadIndexAndABadNumber) {
  const TempDir dir;
  Mesh mesh = testing::MakeOctahedron(0.0, 0.0);
  mesh.triangles[4] = 77;
  ASSERT_TRUE(WriteMeshFile(mesh, dir.File("m.ply")).ok());
  EXPECT_THAT(ReadMeshFile(dir.File("m.ply")).status().ToString(),
              HasSubstr("triangle 1 refers to vertex 77 of 6"));
  mesh = testing::MakeOctahedron(0.0, 0.0);
  mesh.positions[7] = std::numeric_limits<float>::quiet_NaN();
  ASSERT_TRUE(WriteMeshFile(mesh, dir.File("m.ply")).ok());
  EXPECT_THAT(ReadMeshFile(dir.File("m.ply")).status().ToString(), HasSubstr("vertex 2"));
}

}  // namespace
}  // namespace liquidblend::cli
