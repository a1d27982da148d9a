#include "server/encode/draco.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "tests/server/encode/encode_testing.h"
#include "tests/synthetic/shapes.h"

namespace liquidblend::encode {
namespace {

using mesh::TriangleMesh;
using testing::HasSubstr;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

TriangleMesh RoundTrip(const TriangleMesh& mesh, const DracoOptions& options) {
  const absl::StatusOr<std::string> data = EncodeDraco(mesh, options);
  EXPECT_TRUE(data.ok()) << data.status();
  return data.ok() ? Decode(*data) : TriangleMesh();
}

TEST(EncodeDraco, DecodesToTheSameTrianglesOnTheGrid) {
  const TriangleMesh sphere = synthetic::Icosphere({0.1F, 0.2F, 0.3F}, 1.0, 4);
  for (const int bits : {12, 14, 20}) {
    const DracoOptions options = OptionsWith(bits);
    const TriangleMesh decoded = RoundTrip(sphere, options);
    EXPECT_EQ(decoded.num_triangles(), sphere.num_triangles());
    EXPECT_EQ(decoded.num_vertices(), sphere.num_vertices());
    EXPECT_TRUE(mesh::CheckClosed(decoded).closed());
    EXPECT_NEAR(mesh::Volume(decoded), mesh::Volume(sphere), 8 * StepOf(options)) << bits;
  }
}

TEST(EncodeDraco, HoldsNormalsAndVelocities) {
  TriangleMesh sphere = synthetic::Icosphere(Eigen::Vector3f::Zero(), 1.0, 4);
  const std::string plain = *EncodeDraco(sphere, OptionsWith(14));
  sphere.normals = sphere.vertices;
  sphere.velocities = (3.0F * sphere.vertices).colwise() + Eigen::Vector3f(1, 2, 3);
  const absl::StatusOr<std::string> data = EncodeDraco(sphere, OptionsWith(14));
  ASSERT_TRUE(data.ok()) << data.status();
  const TriangleMesh decoded = Decode(*data);
  EXPECT_TRUE(mesh::CheckClosed(decoded).closed());
  ASSERT_EQ(decoded.normals.cols(), sphere.num_vertices());
  ASSERT_EQ(decoded.velocities.cols(), sphere.num_vertices());
  for (Eigen::Index v = 0; v < decoded.num_vertices(); ++v) {
    const Eigen::Vector3f p = decoded.vertices.col(v);
    EXPECT_LT((decoded.normals.col(v) - p).norm(), 0.005F);
    EXPECT_LT((decoded.velocities.col(v) - 3.0F * p - Eigen::Vector3f(1, 2, 3)).norm(), 0.002F);
  }
  EXPECT_LT(data->size(), 8 * plain.size());
  const std::string again = *EncodeDraco(sphere, OptionsWith(14));
  EXPECT_TRUE(*data == again);
}

TEST(EncodeDraco, PositionsAreOffByAtMostHalfAStep) {
  const TriangleMesh torus = synthetic::Torus(Eigen::Vector3f::Zero(), 1.2, 0.5, 60, 30);
  for (const int bits : {8, 12, 20}) {
    const DracoOptions options = OptionsWith(bits);
    const TriangleMesh decoded = RoundTrip(torus, options);
    ASSERT_EQ(decoded.num_triangles(), torus.num_triangles()) << bits;
    // libdraco computes in float: a few units in the last place of the extent besides.
    const double tolerance = StepOf(options) / 2 + 2e-6;
    for (Eigen::Index v = 0; v < decoded.num_vertices(); ++v) {
      const Eigen::Vector3f p = decoded.vertices.col(v);
      const float nearest =
          (torus.vertices.colwise() - p).cwiseAbs().colwise().maxCoeff().minCoeff();
      ASSERT_LE(nearest, tolerance) << "bits " << bits << ", vertex " << v;
    }
  }
}

TEST(EncodeDraco, TakesGridsOfAnySizeAnywhere) {
  for (const float radius_m : {1e-8F, 1e-4F, 1e4F}) {
    DracoOptions options = OptionsWith(14);
    options.grid.origin = {123.4567F * radius_m, -1.5F * radius_m, 0.0F};
    options.grid.extent_m = 3.0F * radius_m;
    const TriangleMesh sphere =
        synthetic::Icosphere({124.9F * radius_m, 0.0F, 1.5F * radius_m}, radius_m, 3);
    for (const Preset preset : {Preset::kFastest, Preset::kBalanced, Preset::kSmallest}) {
      options.preset = preset;
      const TriangleMesh decoded = RoundTrip(sphere, options);
      EXPECT_NEAR(mesh::Volume(decoded) / mesh::Volume(sphere), 1.0, 0.001) << radius_m;
      EXPECT_EQ(NodesOf(decoded, options).size(), 1280U);
    }
  }
}

TEST(EncodeDraco, KeepsEachTriangleAndItsOrientation) {
  const TriangleMesh sphere = synthetic::Icosphere(Eigen::Vector3f::Zero(), 1.0, 3);
  DracoOptions options = OptionsWith(12);
  for (const Preset preset : {Preset::kFastest, Preset::kBalanced, Preset::kSmallest}) {
    options.preset = preset;
    EXPECT_EQ(NodesOf(RoundTrip(sphere, options), options), NodesOf(sphere, options));
  }
}

TEST(EncodeDraco, APointDecodesTheSameInEveryFrameOfAFamily) {
  // Two frames whose bounds differ but that share a part.
  const TriangleMesh shared = synthetic::Icosphere({-1.0F, 0.0F, 0.0F}, 0.4, 2);
  const TriangleMesh small = synthetic::Icosphere({1.0F, 0.1F, 0.0F}, 0.2, 1);
  const TriangleMesh large = synthetic::Icosphere({1.1F, 0.2F, 0.3F}, 0.7, 2);
  const DracoOptions options = OptionsWith(10);
  const auto points_of = [&](const TriangleMesh& other) {
    const TriangleMesh decoded =
        RoundTrip(synthetic::Join(std::vector<TriangleMesh>{shared, other}), options);
    std::set<std::array<float, 3>> points;
    for (Eigen::Index v = 0; v < decoded.num_vertices(); ++v) {
      const Eigen::Vector3f p = decoded.vertices.col(v);
      if (p.x() < 0.0F) points.insert({p.x(), p.y(), p.z()});
    }
    return points;
  };
  EXPECT_EQ(points_of(small), points_of(large));
  EXPECT_GT(points_of(small).size(), 100U);
}

TEST(EncodeDraco, MovesPositionsOutsideOfTheGridOntoItsBorder) {
  TriangleMesh box = synthetic::Box({-100.0F, -1.0F, -1.0F}, {100.0F, 1.0F, 1e30F});
  const TriangleMesh decoded = RoundTrip(box, OptionsWith(12));
  EXPECT_EQ(decoded.num_triangles(), box.num_triangles());
  EXPECT_NEAR(decoded.vertices.row(0).minCoeff(), -2.0, 1e-5);
  EXPECT_NEAR(decoded.vertices.row(0).maxCoeff(), 2.0, 1e-5);
  EXPECT_NEAR(decoded.vertices.row(2).maxCoeff(), 2.0, 1e-5);
  EXPECT_NEAR(decoded.vertices.row(1).maxCoeff(), 1.0, StepOf(OptionsWith(12)));
}

TEST(EncodeDraco, WithoutTrianglesIsAMeshWithoutTriangles) {
  TriangleMesh points_only;
  points_only.vertices = Eigen::Matrix3Xf::Ones(3, 5);
  for (const TriangleMesh& mesh : {TriangleMesh(), points_only}) {
    const TriangleMesh decoded = RoundTrip(mesh, OptionsWith(14));
    EXPECT_EQ(decoded.num_triangles(), 0);
    EXPECT_EQ(decoded.num_vertices(), 0);
  }
}

TEST(EncodeDraco, LeavesOutDegenerateTrianglesAndUnusedVertices) {
  TriangleMesh mesh = synthetic::Icosphere(Eigen::Vector3f::Zero(), 1.0, 1);
  const int64_t num_triangles = mesh.num_triangles();
  const int64_t num_vertices = mesh.num_vertices();
  mesh.vertices.conservativeResize(Eigen::NoChange, num_vertices + 3);
  mesh.vertices.rightCols(3).setConstant(0.25F);
  mesh.triangles.conservativeResize(Eigen::NoChange, num_triangles + 2);
  mesh.triangles.col(num_triangles) = Eigen::Vector3i(0, 0, 5);
  mesh.triangles.col(num_triangles + 1) = Eigen::Vector3i(7, 2, 7);
  const TriangleMesh decoded = RoundTrip(mesh, OptionsWith(14));
  EXPECT_EQ(decoded.num_triangles(), num_triangles);
  EXPECT_EQ(decoded.num_vertices(), num_vertices);
}

TEST(EncodeDraco, KeepsTrianglesWithoutAreaAndEdgesOfFourTriangles) {
  // Two tetrahedra that share an edge, and one vertex that coincides with another.
  TriangleMesh mesh;
  mesh.vertices.resize(3, 6);
  mesh.vertices << 0, 0, 1, 1, -1, -1,  //
      0, 0, 0, 0.5F, 0, 0,              //
      0, 1, 0, 0, 0, 0;
  mesh.triangles.resize(3, 8);
  mesh.triangles << 0, 0, 0, 1, 0, 0, 0, 1,  //
      1, 2, 3, 3, 1, 4, 5, 5,                //
      2, 3, 1, 2, 4, 5, 1, 4;
  ASSERT_TRUE(mesh::CheckClosed(mesh).closed());
  const TriangleMesh decoded = RoundTrip(mesh, OptionsWith(14));
  EXPECT_EQ(decoded.num_triangles(), 8);
}

TEST(EncodeDraco, PresetsTakeFewerAndFewerBytes) {
  for (const TriangleMesh& mesh : {synthetic::Icosphere(Eigen::Vector3f::Zero(), 1.0, 4),
                                   synthetic::Torus(Eigen::Vector3f::Zero(), 1.2, 0.5, 30, 30)}) {
    size_t num_bytes_before = std::numeric_limits<size_t>::max();
    for (const Preset preset : {Preset::kFastest, Preset::kBalanced, Preset::kSmallest}) {
      DracoOptions options = OptionsWith(14);
      options.preset = preset;
      const size_t num_bytes = EncodeDraco(mesh, options)->size();
      EXPECT_LE(num_bytes, num_bytes_before);
      num_bytes_before = num_bytes;
    }
  }
}

TEST(EncodeDraco, GivesTheSameBytesAgain) {
  const TriangleMesh sphere = synthetic::Icosphere(Eigen::Vector3f::Zero(), 1.0, 3);
  EXPECT_EQ(*EncodeDraco(sphere, OptionsWith(14)), *EncodeDraco(sphere, OptionsWith(14)));
}

TEST(EncodeDraco, RefusesBadMeshes) {
  const TriangleMesh good = synthetic::Icosphere(Eigen::Vector3f::Zero(), 1.0, 0);
  const auto refusal = [](const TriangleMesh& mesh) {
    const absl::StatusOr<std::string> data = EncodeDraco(mesh, OptionsWith(14));
    EXPECT_EQ(data.status().code(), absl::StatusCode::kInvalidArgument);
    return std::string(data.status().message());
  };
  for (const int bad_index : {-1, static_cast<int>(good.num_vertices()), 1 << 30}) {
    TriangleMesh mesh = good;
    mesh.triangles(1, 4) = bad_index;
    EXPECT_THAT(refusal(mesh), HasSubstr("triangle 4"));
  }
  for (const float bad : {kNan, kInfinity, -kInfinity}) {
    TriangleMesh mesh = good;
    mesh.vertices(2, 3) = bad;
    EXPECT_THAT(refusal(mesh), HasSubstr("vertex 3"));
  }
}

TEST(EncodeDraco, RefusesOptionsOutOfRangeByName) {
  const auto refusal = [](const DracoOptions& options) {
    const absl::StatusOr<std::string> data = EncodeDraco(TriangleMesh(), options);
    EXPECT_EQ(data.status().code(), absl::StatusCode::kInvalidArgument);
    return std::string(data.status().message());
  };
  for (const int bits : {7, 21, 0, -1, 1000}) {
    EXPECT_THAT(refusal(OptionsWith(bits)), HasSubstr("position_bits is " + std::to_string(bits)));
  }
  for (const float extent : {0.0F, -1.0F}) {
    DracoOptions options = OptionsWith(14);
    options.grid.extent_m = extent;
    EXPECT_THAT(refusal(options), HasSubstr("grid.extent_m"));
  }
  for (const float extent : {kNan, kInfinity}) {
    DracoOptions options = OptionsWith(14);
    options.grid.extent_m = extent;
    EXPECT_THAT(refusal(options), HasSubstr("extent"));
  }
  DracoOptions options = OptionsWith(14);
  options.grid.origin[1] = kNan;
  EXPECT_THAT(refusal(options), HasSubstr("grid.origin[1]"));
}

}  // namespace
}  // namespace liquidblend::encode
