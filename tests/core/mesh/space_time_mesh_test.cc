#include "core/mesh/space_time_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <limits>

namespace liquidblend::mesh::space_time_mesh_test {
namespace {

using ::testing::HasSubstr;

constexpr int kNumFrames = 3;

SpaceTimeMesh WithVertices(const Eigen::Matrix4Xf& vertices) {
  SpaceTimeMesh mesh;
  mesh.vertices = vertices;
  mesh.normals = Eigen::Matrix4Xf::Constant(4, vertices.cols(), 0.5f);
  mesh.velocities = Eigen::Matrix3Xf::Zero(3, vertices.cols());
  mesh.num_frames = kNumFrames;
  mesh.edge_length_m = 0.1;
  return mesh;
}

// The boundary of {0, 1}^3 x {t_low, t_high}: vertex x + 2 y + 4 z + 8 t.
SpaceTimeMesh Tesseract(float t_low, float t_high) {
  Eigen::Matrix4Xf vertices(4, 16);
  for (int v = 0; v < 16; ++v) {
    vertices.col(v) << float(v & 1), float(v >> 1 & 1), float(v >> 2 & 1), v < 8 ? t_low : t_high;
  }
  SpaceTimeMesh mesh = WithVertices(vertices);
  for (int normal_axis = 0; normal_axis < 4; ++normal_axis) {
    for (int side = 0; side < 2; ++side) {
      std::array<int, 3> axes = {};
      for (int axis = 0, i = 0; axis < 4; ++axis) {
        if (axis != normal_axis) axes[i++] = axis;
      }
      // The sign of (axes, normal_axis) as a permutation, and of the normal's direction.
      if ((normal_axis + side) % 2 != 0) std::swap(axes[0], axes[1]);
      Hexahedron cell;
      for (int c = 0; c < 8; ++c) {
        cell[c] = side << normal_axis | (c & 1) << axes[0] | (c >> 1 & 1) << axes[1] |
                  (c >> 2 & 1) << axes[2];
      }
      mesh.hexahedra.push_back(cell);
    }
  }
  return mesh;
}

// A tetrahedron that lasts from t = 0 to t = 1: four wedges, closed by two tetrahedra.
SpaceTimeMesh LastingTetrahedron() {
  Eigen::Matrix4Xf vertices = Eigen::Matrix4Xf::Zero(4, 8);
  for (int v = 0; v < 8; ++v) {
    if (v % 4 > 0) vertices(v % 4 - 1, v) = 1.0f;
    vertices(3, v) = v < 4 ? 0.0f : 1.0f;
  }
  SpaceTimeMesh mesh = WithVertices(vertices);
  mesh.tetrahedra = {{0, 2, 1, 3}, {4, 5, 6, 7}};
  for (const auto& [a, b, c] :
       {std::array{1, 2, 3}, std::array{0, 3, 2}, std::array{0, 1, 3}, std::array{0, 2, 1}}) {
    mesh.wedges.push_back({a, c, b, a + 4, c + 4, b + 4});
  }
  return mesh;
}

// A cube at t = 0 that shrinks to a point at t = 1: one hexahedron and six pyramids.
SpaceTimeMesh ShrinkingCube() {
  Eigen::Matrix4Xf vertices(4, 9);
  for (int v = 0; v < 8; ++v) {
    vertices.col(v) << float(v & 1), float(v >> 1 & 1), float(v >> 2 & 1), 0.0f;
  }
  vertices.col(8) << 0.5f, 0.5f, 0.5f, 1.0f;
  SpaceTimeMesh mesh = WithVertices(vertices);
  mesh.hexahedra = {{1, 0, 3, 2, 5, 4, 7, 6}};
  mesh.pyramids = {{1, 3, 2, 0, 8}, {6, 7, 5, 4, 8}, {4, 5, 1, 0, 8},
                   {3, 7, 6, 2, 8}, {2, 6, 4, 0, 8}, {5, 7, 3, 1, 8}};
  return mesh;
}

// All four kinds of cells, in two parts.
SpaceTimeMesh AllKinds() {
  const SpaceTimeMesh cube = ShrinkingCube();
  SpaceTimeMesh mesh = LastingTetrahedron();
  const auto offset = static_cast<int32_t>(mesh.num_vertices());
  Eigen::Matrix4Xf vertices(4, mesh.num_vertices() + cube.num_vertices());
  vertices << mesh.vertices, cube.vertices;
  SpaceTimeMesh both = WithVertices(vertices);
  both.tetrahedra = mesh.tetrahedra;
  both.wedges = mesh.wedges;
  both.pyramids = cube.pyramids;
  both.hexahedra = cube.hexahedra;
  for (Pyramid& cell : both.pyramids) {
    for (int32_t& v : cell) v += offset;
  }
  for (Hexahedron& cell : both.hexahedra) {
    for (int32_t& v : cell) v += offset;
  }
  return both;
}

void ExpectFault(const SpaceTimeMesh& mesh, const std::string& words) {
  const absl::Status status = Validate(mesh);
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr(words));
}

double Orientation(const SpaceTimeMesh& mesh, const std::array<int32_t, 4>& corners,
                   const Eigen::Vector4f& out) {
  Eigen::Matrix4f frame;
  for (int i = 0; i < 3; ++i) {
    frame.col(i) = mesh.vertices.col(corners[i + 1]) - mesh.vertices.col(corners[0]);
  }
  frame.col(3) = out;
  return frame.determinant();
}

TEST(ValidateSpaceTimeMesh, AcceptsClosedComplexesOfEachKindOfCell) {
  EXPECT_TRUE(Validate(Tesseract(0.0f, 1.0f)).ok()) << Validate(Tesseract(0.0f, 1.0f));
  EXPECT_TRUE(Validate(LastingTetrahedron()).ok()) << Validate(LastingTetrahedron());
  EXPECT_TRUE(Validate(ShrinkingCube()).ok()) << Validate(ShrinkingCube());
  EXPECT_TRUE(Validate(AllKinds()).ok()) << Validate(AllKinds());
}

// The complexes above are oriented as the header says, so the facet tables agree with it.
TEST(ValidateSpaceTimeMesh, AcceptsTheOrientationOfTheHeader) {
  const SpaceTimeMesh tesseract = Tesseract(0.0f, 1.0f);
  ASSERT_EQ(tesseract.hexahedra.size(), 8u);
  for (const Hexahedron& h : tesseract.hexahedra) {
    Eigen::Vector4f middle = Eigen::Vector4f::Zero();
    for (const int32_t v : h) middle += tesseract.vertices.col(v) / 8.0f;
    const Eigen::Vector4f out = middle - Eigen::Vector4f::Constant(0.5f);
    EXPECT_GT(Orientation(tesseract, {h[0], h[1], h[2], h[4]}, out), 0.0);
  }
  const SpaceTimeMesh lasting = LastingTetrahedron();
  ASSERT_EQ(lasting.wedges.size(), 4u);
  for (const Wedge& w : lasting.wedges) {
    Eigen::Vector4f out = -Eigen::Vector4f(0.25f, 0.25f, 0.25f, 0.0f);
    for (int i = 0; i < 3; ++i) out.head<3>() += lasting.vertices.col(w[i]).head<3>() / 3.0f;
    EXPECT_GT(Orientation(lasting, {w[0], w[1], w[2], w[3]}, out), 0.0);
  }
  const Eigen::Vector4f later(0.0f, 0.0f, 0.0f, 1.0f);
  EXPECT_GT(Orientation(lasting, lasting.tetrahedra[1], later), 0.0);
  EXPECT_GT(Orientation(lasting, lasting.tetrahedra[0], -later), 0.0);
  const SpaceTimeMesh cube = ShrinkingCube();
  EXPECT_GT(Orientation(cube, {1, 0, 3, 5}, -later), 0.0);
  for (const Pyramid& p : cube.pyramids) {
    Eigen::Vector4f middle = Eigen::Vector4f::Zero();
    for (const int32_t v : p) middle += cube.vertices.col(v) / 5.0f;
    const Eigen::Vector4f out = middle - Eigen::Vector4f(0.5f, 0.5f, 0.5f, 0.2f);
    EXPECT_GT(Orientation(cube, {p[0], p[1], p[3], p[4]}, out), 0.0);
  }
}

TEST(ValidateSpaceTimeMesh, AcceptsAnEmptyMesh) {
  EXPECT_TRUE(Validate(WithVertices(Eigen::Matrix4Xf(4, 0))).ok());
}

TEST(ValidateSpaceTimeMesh, AcceptsFacetsWherePartsTouch) {
  SpaceTimeMesh mesh = LastingTetrahedron();
  mesh.tetrahedra.insert(mesh.tetrahedra.end(), {mesh.tetrahedra[0], mesh.tetrahedra[1]});
  for (int i = 0; i < 4; ++i) mesh.wedges.push_back(mesh.wedges[i]);
  EXPECT_TRUE(Validate(mesh).ok()) << Validate(mesh);
}

TEST(ValidateSpaceTimeMesh, AcceptsOpenFacetsInTheEndSlabsOnly) {
  SpaceTimeMesh mesh = Tesseract(-0.5f, 2.5f);
  mesh.hexahedra.resize(6);  // the last two are flat in time
  ExpectFault(mesh, "facet (");
  mesh.num_first_vertices = 8;
  ExpectFault(mesh, "facet (");
  mesh.num_last_vertices = 8;
  EXPECT_TRUE(Validate(mesh).ok()) << Validate(mesh);
}

TEST(ValidateSpaceTimeMesh, NamesAMissingCellOfEachKindByAFacet) {
  SpaceTimeMesh mesh = AllKinds();
  mesh.tetrahedra.pop_back();
  ExpectFault(mesh, "facet (4 5 6) of wedge 3 is run through 1 times in one direction and 0 times");
  mesh = AllKinds();
  mesh.wedges.pop_back();
  ExpectFault(mesh, "facet (0 1 2) of tetrahedron 0");
  mesh = AllKinds();
  mesh.pyramids.erase(mesh.pyramids.begin());
  ExpectFault(mesh, "facet (8 9 11 10) of hexahedron 0");
  mesh = AllKinds();
  mesh.hexahedra.clear();
  ExpectFault(mesh, "facet (8 9 11 10) of pyramid 0");
}

TEST(ValidateSpaceTimeMesh, NamesAnInsideOutCell) {
  SpaceTimeMesh mesh = AllKinds();
  std::swap(mesh.tetrahedra[1][0], mesh.tetrahedra[1][1]);
  ExpectFault(mesh, "facet (4 5 6) of tetrahedron 1");
}

TEST(ValidateSpaceTimeMesh, NamesCornersThatAreOutOfRangeOrRepeated) {
  SpaceTimeMesh mesh = AllKinds();
  mesh.tetrahedra[1][2] = -1;
  ExpectFault(mesh, "tetrahedron 1 has vertex -1, of 17");
  mesh = AllKinds();
  mesh.pyramids[3][4] = 17;
  ExpectFault(mesh, "pyramid 3 has vertex 17, of 17");
  mesh = AllKinds();
  mesh.wedges[2][5] = mesh.wedges[2][0];
  ExpectFault(mesh, "wedge 2 has vertex 0 twice");
  mesh = AllKinds();
  mesh.hexahedra[0][7] = 1000;
  ExpectFault(mesh, "hexahedron 0 has vertex 1000, of 17");
}

TEST(ValidateSpaceTimeMesh, NamesNumbersThatAreNotFinite) {
  SpaceTimeMesh mesh = AllKinds();
  mesh.vertices(3, 5) = std::numeric_limits<float>::quiet_NaN();
  ExpectFault(mesh, "vertex 5 is not finite");
  mesh = AllKinds();
  mesh.normals(0, 6) = std::numeric_limits<float>::infinity();
  ExpectFault(mesh, "normal 6 is not finite");
  mesh = AllKinds();
  mesh.velocities(2, 16) = -std::numeric_limits<float>::infinity();
  ExpectFault(mesh, "velocity 16 is not finite");
}

TEST(ValidateSpaceTimeMesh, NamesArraysOfTheWrongSize) {
  SpaceTimeMesh mesh = AllKinds();
  mesh.normals.conservativeResize(4, 3);
  ExpectFault(mesh, "3 normals for 17 vertices");
  mesh = AllKinds();
  mesh.velocities.conservativeResize(3, 16);
  ExpectFault(mesh, "16 velocities for 17 vertices");
  mesh = AllKinds();
  mesh.normals.resize(4, 0);
  mesh.velocities.resize(3, 0);
  EXPECT_TRUE(Validate(mesh).ok());
}

TEST(ValidateSpaceTimeMesh, NamesEndSlabsThatReachIntoTheAnimation) {
  SpaceTimeMesh mesh = Tesseract(-0.5f, 2.5f);
  mesh.num_first_vertices = 9;
  ExpectFault(mesh, "vertex 8 of the first slab has time 2.5, not before frame 0");
  mesh.num_first_vertices = 8;
  mesh.num_last_vertices = 8;
  mesh.vertices(3, 10) = 2.0f;
  ExpectFault(mesh, "vertex 10 of the last slab has time 2, not after frame 2");
  mesh.num_last_vertices = 9;
  ExpectFault(mesh, "8 vertices in the first and 9 in the last slab, of 16");
  mesh.num_first_vertices = -1;
  ExpectFault(mesh, "-1 vertices in the first");
}

TEST(ValidateSpaceTimeMesh, NamesUnusableNumbers) {
  SpaceTimeMesh mesh = AllKinds();
  mesh.num_frames = 0;
  ExpectFault(mesh, "num_frames = 0");
  mesh = AllKinds();
  mesh.frames_per_second = 0.0;
  ExpectFault(mesh, "frames_per_second = 0");
  mesh = AllKinds();
  mesh.edge_length_m = -1.0;
  ExpectFault(mesh, "edge_length_m = -1");
}

}  // namespace
}  // namespace liquidblend::mesh::space_time_mesh_test
