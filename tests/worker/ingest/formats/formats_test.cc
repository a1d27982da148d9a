// What the PLY, OBJ and Mantaflow readers take and refuse.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tests/synthetic/shapes.h"
#include "tests/worker/ingest/formats/encode_files.h"
#include "worker/ingest/formats/readers.h"

namespace liquidblend::ingest {
namespace {

using testing::HasSubstr;

template <typename Value>
std::string Message(const absl::StatusOr<Value>& value) {
  return value.ok() ? "no error" : std::string(value.status().message());
}

std::string PlyError(std::string_view text) { return Message(ReadPly(AsBytes(text))); }
std::string ObjError(std::string_view text) { return Message(ReadObj(AsBytes(text))); }

constexpr std::string_view kVertexHeader =
    "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
    "property float z\n";

TEST(ReadPly, ReadsTheSameFromAllEncodings) {
  mesh::TriangleMesh ball = synthetic::Icosphere({0.1f, 0.2f, 0.3f}, 0.7, 1);
  ball.velocities = 3 * ball.vertices;
  for (const PlyKind kind : {PlyKind::kAscii, PlyKind::kLittleEndian, PlyKind::kBigEndian}) {
    const absl::StatusOr<mesh::TriangleMesh> read = ReadPly(Ply(ball, kind));
    ASSERT_TRUE(read.ok()) << read.status();
    EXPECT_EQ(read->vertices, ball.vertices);
    EXPECT_EQ(read->velocities, ball.velocities);
    EXPECT_EQ(read->triangles, ball.triangles);
  }
}

TEST(ReadPly, SkipsWhatItDoesNotKnow) {
  const absl::StatusOr<mesh::TriangleMesh> read = ReadPly(AsBytes(
      "ply\r\nformat ascii 1.0\r\nobj_info by hand\r\nelement camera 2\r\nproperty double fov\r\n"
      "element vertex 3\r\nproperty uchar red\r\nproperty double z\r\nproperty int y\r\n"
      "property list uchar float junk\r\nproperty float32 x\r\n"
      "element face 1\r\nproperty short flag\r\nproperty list uint8 uint32 vertex_index\r\n"
      "property list int int more\r\nelement edge 1\r\nproperty int a\r\nend_header\r\n"
      "1.5\r\n2.5\r\n"
      "255 3 2 2 7 8 1\r\n9 6 -5 0 +4\r\n9 9 8 0 7e0\r\n"
      "-1 3 2 0 1 2 11 12\r\n"
      "4\r\n"));
  ASSERT_TRUE(read.ok()) << read.status();
  Eigen::Matrix3f positions;
  positions.transpose() << 1, 2, 3, 4, -5, 6, 7, 8, 9;
  EXPECT_EQ(read->vertices, positions);
  EXPECT_EQ(read->velocities.cols(), 0);
  EXPECT_EQ(read->triangles, Eigen::Vector3i(2, 0, 1));
}

TEST(ReadPly, CutsPolygonsIntoTriangles) {
  // The quad is concave at corner 3, so only the diagonal from there works; the pentagon is a fan.
  const absl::StatusOr<mesh::TriangleMesh> read = ReadPly(
      AsBytes("ply\nformat ascii 1.0\nelement face 2\nproperty list uchar int vertex_indices\n"
              "element vertex 5\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
              "4 0 1 2 3\n5 0 1 2 3 4\n0 0 0\n4 0 0\n0 4 0\n1 1 0\n0 1 1\n"));
  ASSERT_TRUE(read.ok()) << read.status();
  Eigen::Matrix<int, 3, 5> triangles;
  triangles.transpose() << 1, 2, 3, 1, 3, 0, 0, 1, 2, 0, 2, 3, 0, 3, 4;
  EXPECT_EQ(read->triangles, triangles);
}

TEST(ReadPly, RefusesWithTheElementAtFault) {
  const std::string vertex(kVertexHeader);
  const std::string face = "element face 1\nproperty list char int vertex_indices\nend_header\n";
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"plywood\n", "does not begin with a line \"ply\""},
      {"ply\nend_header\n", "no format line"},
      {"ply\nformat ascii 1.1\n", "unknown format version \"1.1\""},
      {"ply\nformat text 1.0\n", "unknown format \"text\""},
      {"ply\nwhat is this\n", "unknown line \"what is this\""},
      {"ply\nelement vertex -3\n", "element \"vertex\" has the count \"-3\""},
      {"ply\nelement vertex 3000000000\n", "has the count \"3000000000\""},
      {"ply\nelement vertex 1\nproperty int x\nelement vertex 1\n", "twice the element \"vertex\""},
      {"ply\nproperty int x\n", "a property before any element"},
      {"ply\nelement vertex 1\nproperty half x\n", "unknown type \"half\""},
      {"ply\nelement vertex 1\nproperty list float int x\n", "a list's length of type \"float\""},
      {"ply\nelement vertex 1\nproperty int x\nproperty int x\n", "twice the property \"x\""},
      {"ply\nformat ascii 1.0\nelement huge 2147483647\nend_header\n",
       "no property in element \"huge\""},
      {vertex, "the PLY header does not end"},
      {vertex + "property float vx\n" + face + "0 0 0 0 3 0 0 0",
       "element vertex has no scalar property vy"},
      {"ply\nformat ascii 1.0\nelement vertex 0\nproperty int x\nelement face 0\n"
       "property list char int vertex_indices\nend_header\n",
       "element vertex has no scalar property y"},
      {vertex + "element face 0\nproperty int x\nend_header\n0 0 0\n",
       "no list of integers vertex_indices"},
      {vertex + "end_header\n0 0 0\n", "the header has no element face"},
      {"ply\nformat ascii 1.0\n" + face + "3 0 0 0", "the header has no element vertex"},
      {vertex + face + "0 0 zero 3 0 0 0", "vertex 0: \"zero\" is not a number"},
      {vertex + face + "0 0 0 3 0 0.5 0", "face 0: \"0.5\" is not a number of the declared type"},
      {vertex + face + "0 0 0 3 0 0", "truncated at face 0 of 1"},
      {vertex + face + "0 0 0 2 0 0", "face 0 has 2 corners"},
      {vertex + face + "0 0 0 -1 0 0", "face 0 has -1 corners"},
      {vertex + face + "0 0 0 9223372036854775807 0", "is not a number of the declared type"},
      {vertex + face + "0 0 0 3 0 0 1", "face 0: vertex 1 is not in [0, 1)"},
      {vertex + face + "0 0 0 3 0 0 -1", "face 0: vertex -1 is out of range"},
      {vertex + face + "0 0 0 3 0 0 0 77", "\"77\" follows the last element"},
  };
  for (const auto& [text, message] : cases) EXPECT_THAT(PlyError(text), HasSubstr(message)) << text;
}

TEST(ReadPly, RefusesPromisesThatTheFileCannotHold) {
  Bytes bytes = ToBytes(
      "ply\nformat binary_little_endian 1.0\nelement vertex 2000000000\nproperty float x\n"
      "property float y\nproperty float z\nelement face 0\n"
      "property list uchar int vertex_indices\nend_header\n");
  EXPECT_THAT(Message(ReadPly(bytes)),
              HasSubstr("promises 2000000000 of element \"vertex\", more than the file can hold"));
}

TEST(ReadPly, RefusesBytesBehindTheLastElement) {
  Bytes bytes = Ply(synthetic::Box({0, 0, 0}, {1, 1, 1}), PlyKind::kLittleEndian);
  bytes.resize(bytes.size() + 3);
  EXPECT_THAT(Message(ReadPly(bytes)), HasSubstr("3 bytes follow the last element"));
}

TEST(ReadObj, ReadsCornersInAllNotations) {
  const absl::StatusOr<mesh::TriangleMesh> read = ReadObj(
      AsBytes("# comment\nmtllib a.mtl\no liquid\nf 1 2//1 3/4/5\nv 1 2 3\r\nv +4 5e0 .6 1.0\n"
              "vt 0 0\nvn 0 0 1\n\nv 7 8 9 0.5 0.5 0.5\ns off\nusemtl water\nf -3 -2 \\\n -1\n"));
  ASSERT_TRUE(read.ok()) << read.status();
  Eigen::Matrix3f positions;
  positions.transpose() << 1, 2, 3, 4, 5, 0.6f, 7, 8, 9;
  EXPECT_EQ(read->vertices, positions);
  Eigen::Matrix<int, 3, 2> triangles;
  triangles << 0, 0, 1, 1, 2, 2;
  EXPECT_EQ(read->triangles, triangles);
}

TEST(ReadObj, RefusesWithTheElementAtFault) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"v 1 2\n", "vertex 1: \"\" is not a coordinate"},
      {"v 0 0 0\nv 1 2 three\n", "vertex 2: \"three\" is not a coordinate"},
      {"v 1e999 0 0\n", "\"1e999\" is not a coordinate"},
      {"v 1 2 3\nf 1 1 2\n", "face 1: vertex 2 is not in [1, 2)"},
      {"v 1 2 3\nf 1 1 1\nf 1 0 1\n", "face 2: \"0\" is not a vertex"},
      {"v 1 2 3\nf 1 -2 1\n", "face 1: \"-2\" is not a vertex"},
      {"v 1 2 3\nf 1 /1 1\n", "face 1: \"/1\" is not a vertex"},
      {"v 1 2 3\nf 99999999999999999999 1 1\n", "is not a vertex"},
      {"v 1 2 3\nf 1 1\n", "face 1 has 2 corners"},
      {"curv 0 1\n", "\"curv\" is not a statement of a polygon OBJ"},
      {"\x01\x02\x03", "\"\\x01\\x02\\x03\" is not a statement"},
  };
  for (const auto& [text, message] : cases) EXPECT_THAT(ObjError(text), HasSubstr(message)) << text;
}

// The corners' positions, triangle by triangle.
Eigen::Matrix3Xf CornerPositions(const mesh::TriangleMesh& mesh) {
  Eigen::Matrix3Xf positions(3, mesh.triangles.size());
  for (Eigen::Index c = 0; c < positions.cols(); ++c) {
    positions.col(c) = mesh.vertices.col(mesh.triangles.reshaped()[c]);
  }
  return positions;
}

TEST(ReadStl, WeldsCornersOfTheSamePosition) {
  const mesh::TriangleMesh ball = synthetic::Icosphere({0.1f, 0.2f, 0.3f}, 0.7, 2);
  for (const Bytes& bytes : {StlBinary(ball), StlAscii(ball)}) {
    const absl::StatusOr<mesh::TriangleMesh> read = ReadStl(bytes);
    ASSERT_TRUE(read.ok()) << read.status();
    EXPECT_EQ(read->num_vertices(), ball.num_vertices());
    EXPECT_EQ(CornerPositions(*read), CornerPositions(ball));
    EXPECT_EQ(read->velocities.cols(), 0);
    EXPECT_TRUE(mesh::CheckClosed(*read).closed());
  }
}

TEST(ReadStl, NumbersVerticesAsTheTrianglesNameThem) {
  const absl::StatusOr<mesh::TriangleMesh> read = ReadStl(AsBytes(
      "SOLID a b c\r\nfacet normal 0 0 1 outer loop vertex 0 0 0 vertex 2 0 0 vertex 1e0 3 0\r\n"
      "endloop endfacet\r\nendsolid a b c\r\nsolid\nFacet Normal nan nan nan\nouter loop\n"
      "vertex 2 0 -0 vertex 9 9 9 vertex -0 0 0 endloop endfacet endsolid"));
  ASSERT_TRUE(read.ok()) << read.status();
  Eigen::Matrix<int, 3, 2> triangles;
  triangles.transpose() << 0, 1, 2, 1, 3, 0;
  EXPECT_EQ(read->triangles, triangles);
  EXPECT_EQ(read->vertices.col(3), Eigen::Vector3f(9, 9, 9));
}

TEST(ReadStl, RefusesWithTheTriangleAtFault) {
  const std::string facet =
      "solid\nfacet normal 0 0 1 outer loop vertex 0 0 0 vertex 1 0 0 vertex 0 1 0 endloop "
      "endfacet ";
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"solid", "truncated at triangle 0"},
      {facet, "truncated at triangle 1"},
      {facet + "facet normal 0 0", "truncated at triangle 1"},
      {facet + "face normal", "triangle 1: \"face\" where facet or endsolid should be"},
      {facet + "facet normal 0 0 up", "triangle 1: \"up\" where a number should be"},
      {facet + "facet normal 0 0 1 outer loop vertex 0 0 0 vertex 0 0 0 endloop",
       "triangle 1: \"endloop\" where vertex should be"},
      {facet + "endsolid\nsomething", "triangle 1: \"something\" where solid should be"},
      {std::string(50, 'x'), "truncated in its header, after 50 of 84 bytes"},
  };
  for (const auto& [text, message] : cases) {
    EXPECT_THAT(Message(ReadStl(AsBytes(text))), HasSubstr(message)) << text;
  }
}

TEST(ReadStl, RefusesBinaryFilesOfAnotherSizeThanTheCountSays) {
  Bytes bytes = StlBinary(synthetic::Box({0, 0, 0}, {1, 1, 1}));
  bytes[0] = std::byte{'b'};
  bytes.push_back(std::byte{0});
  EXPECT_THAT(Message(ReadStl(bytes)), HasSubstr("1 bytes follow the last of 12 triangles"));
  bytes.resize(bytes.size() - 2);
  EXPECT_THAT(Message(ReadStl(bytes)),
              HasSubstr("the header promises 12 triangles, but 11 are there"));
  const uint32_t count = 0xffffffffu;
  std::memcpy(bytes.data() + 80, &count, sizeof(count));
  EXPECT_THAT(Message(ReadStl(bytes)), HasSubstr("promises 4294967295 triangles"));
}

TEST(ReadMantaflow, RefusesWithTheCountsAtFault) {
  const mesh::TriangleMesh box = synthetic::Box({0, 0, 0}, {1, 1, 1});
  const auto set = [](Bytes bytes, size_t at, int32_t value) {
    std::memcpy(bytes.data() + at, &value, sizeof(value));
    return Message(ReadMantaflowMesh(Gzip(bytes)));
  };
  const Bytes raw = RawBobj(box);
  const size_t normals = 4 + 12 * 8;
  const size_t triangles = 2 * normals;
  EXPECT_THAT(set(raw, 0, -1), HasSubstr("number of vertices is -1"));
  EXPECT_THAT(set(raw, 0, 1 << 30), HasSubstr("promises 1073741824 vertices"));
  EXPECT_THAT(set(raw, normals, 7), HasSubstr("7 normals for 8 vertices"));
  EXPECT_THAT(set(raw, triangles, 1 << 29), HasSubstr("promises 536870912 triangles"));
  EXPECT_THAT(set(raw, triangles, 11), HasSubstr("more data follows where the frame ends"));
  EXPECT_THAT(set(raw, triangles, 13), HasSubstr("the gzip stream ends after 348 inflated bytes"));
  EXPECT_THAT(Message(ReadMantaflowMesh(raw)), HasSubstr("corrupt"));
}

TEST(ReadMantaflow, RefusesVelocitiesThatDoNotFit) {
  const Bytes raw = RawUni(Eigen::Matrix3Xf::Ones(3, 8));
  EXPECT_TRUE(ReadMantaflowVelocities(Gzip(raw), 8).ok());
  EXPECT_THAT(Message(ReadMantaflowVelocities(Gzip(raw), 9)),
              HasSubstr("8 velocities for the 9 vertices"));
  Bytes bad = raw;
  bad[0] = std::byte{'X'};
  EXPECT_THAT(Message(ReadMantaflowVelocities(Gzip(bad), 8)), HasSubstr("MD01"));
  bad = raw;
  bad[24] = std::byte{4};
  EXPECT_THAT(Message(ReadMantaflowVelocities(Gzip(bad), 8)),
              HasSubstr("bytes per element are 4, not 12"));
}

}  // namespace
}  // namespace liquidblend::ingest
