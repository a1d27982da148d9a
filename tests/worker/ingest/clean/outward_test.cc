// Parts of frames that are inside out.
#include "worker/ingest/clean/outward.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <ctime>
#include <numbers>
#include <vector>

#include "tests/synthetic/shapes.h"
#include "worker/ingest/clean/clean.h"

namespace liquidblend::ingest::outward_test {
namespace {

using mesh::TriangleMesh;
using synthetic::Box;
using synthetic::Flipped;
using synthetic::Icosphere;
using ::testing::ElementsAre;

TriangleMesh Pool() { return Box({-4, -4, -2}, {4, 4, 0}, 4); }
TriangleMesh Drop(const Eigen::Vector3f& centre_m, double radius_m = 0.25) {
  return Icosphere(centre_m, radius_m, 2);
}

class TurnPartsOutwardTest : public ::testing::Test {
 protected:
  // Cleans a frame of these parts. They stay in their order.
  void CleanFrame(const std::vector<TriangleMesh>& parts) {
    before_ = frame_ = synthetic::Join(parts);
    const absl::StatusOr<CleanCounts> counts = Clean(frame_);
    ASSERT_TRUE(counts.ok()) << counts.status();
    counts_ = *counts;
  }

  // Whether the parts face outward, in their order.
  std::vector<bool> FaceOutward(const std::vector<TriangleMesh>& parts) const {
    std::vector<bool> outward;
    Eigen::Index begin = 0;
    for (const TriangleMesh& part : parts) {
      TriangleMesh alone = frame_;
      alone.triangles = frame_.triangles.middleCols(begin, part.num_triangles());
      outward.push_back(mesh::Volume(alone) > 0);
      begin += part.num_triangles();
    }
    return outward;
  }

  TriangleMesh before_, frame_;
  CleanCounts counts_;
};

TEST_F(TurnPartsOutwardTest, ADropThatFacesInwardIsTurned) {
  const std::vector<TriangleMesh> parts = {Pool(), Flipped(Drop({1, 2, 3})), Drop({-1, 2, 3})};
  CleanFrame(parts);
  EXPECT_THAT(FaceOutward(parts), ElementsAre(true, true, true));
  EXPECT_EQ(counts_.num_turned, 1);
  EXPECT_NEAR((counts_.first_turned - Eigen::Vector3f(1, 2, 3)).norm(), 0.25, 1e-5);
  EXPECT_EQ(frame_.vertices, before_.vertices);
  TriangleMesh expected = synthetic::Join(std::vector{Pool(), Drop({1, 2, 3}), Drop({-1, 2, 3})});
  EXPECT_TRUE(mesh::CheckClosed(frame_).closed());
  EXPECT_DOUBLE_EQ(mesh::Volume(frame_), mesh::Volume(expected));
}

TEST_F(TurnPartsOutwardTest, ABubbleStaysAsItIs) {
  const std::vector<TriangleMesh> parts = {Pool(), Flipped(Drop({0.1f, 0.2f, -1}))};
  CleanFrame(parts);
  EXPECT_THAT(FaceOutward(parts), ElementsAre(true, false));
  EXPECT_EQ(counts_.num_turned, 0);
  EXPECT_EQ(frame_.triangles, before_.triangles);
}

TEST_F(TurnPartsOutwardTest, ABubbleInADropThatOverlapsThePoolStaysAsItIs) {
  const std::vector<TriangleMesh> parts = {Pool(), Drop({0, 0, 0}, 1),
                                           Flipped(Drop({0, 0, -0.5f}))};
  CleanFrame(parts);
  EXPECT_THAT(FaceOutward(parts), ElementsAre(true, true, false));
  EXPECT_EQ(counts_.num_turned, 0);
}

TEST_F(TurnPartsOutwardTest, ADropInABubbleIsTurnedIfItFacesInward) {
  const TriangleMesh bubble = Flipped(Drop({0, 0, -1}, 0.9));
  for (const bool is_turned : {false, true}) {
    const TriangleMesh drop = Drop({0.1f, 0.2f, -1.1f});
    const std::vector<TriangleMesh> parts = {Pool(), bubble, is_turned ? Flipped(drop) : drop};
    CleanFrame(parts);
    EXPECT_THAT(FaceOutward(parts), ElementsAre(true, false, true));
    EXPECT_EQ(counts_.num_turned, is_turned ? 1 : 0);
  }
}

TEST_F(TurnPartsOutwardTest, ADropWithABubbleIsTurnedAsAWhole) {
  // And a drop in that bubble.
  const std::vector<TriangleMesh> parts = {Pool(), Flipped(Drop({1, 2, 3}, 1)),
                                           Drop({1, 2, 3}, 0.6), Flipped(Drop({1.1f, 2, 3}, 0.2))};
  CleanFrame(parts);
  EXPECT_THAT(FaceOutward(parts), ElementsAre(true, true, false, true));
  EXPECT_EQ(counts_.num_turned, 3);
}

TEST_F(TurnPartsOutwardTest, DropsBesideAndBehindEachOtherDoNotCount) {
  // Along each axis there is another part, and one that the drop's box is in.
  std::vector<TriangleMesh> parts = {Flipped(Drop({0, 0, 0}))};
  for (int axis = 0; axis < 3; ++axis) {
    for (const float side : {-1.0f, 1.0f})
      parts.push_back(Drop(side * Eigen::Vector3f::Unit(axis)));
  }
  parts.push_back(synthetic::Torus({0, 0, 0}, 2, 0.4, 24, 12));
  CleanFrame(parts);
  EXPECT_THAT(FaceOutward(parts), ::testing::Each(true));
  EXPECT_EQ(counts_.num_turned, 1);
}

// Surfaces that were moved by velocities may cross each other.
TEST_F(TurnPartsOutwardTest, ABubbleThatReachesOutOfThePoolALittleStaysAsItIs) {
  for (const Eigen::Vector3f& centre :
       {Eigen::Vector3f(0, 0, -0.15f), Eigen::Vector3f(3.85f, 0, -1),
        Eigen::Vector3f(0, -3.85f, -1), Eigen::Vector3f(-3.85f, 0, -1),
        Eigen::Vector3f(0, 0, -1.85f)}) {
    CleanFrame({Pool(), Flipped(Drop(centre))});
    EXPECT_EQ(counts_.num_turned, 0) << centre.transpose();
  }
}

// Vertices, edges and diagonals of the boxes lie behind one another along all axes.
TEST_F(TurnPartsOutwardTest, PartsWhoseCoordinatesAreAllSpecialAreNoTrouble) {
  for (const float height : {-1.0f, 1.0f}) {
    std::vector<TriangleMesh> parts = {Box({-2, -2, -2}, {2, 2, 0}, 4)};
    for (const float x : {-1.0f, 0.0f, 0.5f}) {
      for (const float y : {-1.0f, 0.0f, 0.5f}) {
        parts.push_back(Flipped(Box({x, y, height - 0.25f}, {x + 0.25f, y + 0.25f, height})));
      }
    }
    CleanFrame(parts);
    EXPECT_EQ(counts_.num_turned, height > 0 ? 9 : 0);
  }
}

// A sheet without thickness encloses nothing, on whatever side it faces.
TEST_F(TurnPartsOutwardTest, APartWithoutVolumeStaysAsItIs) {
  TriangleMesh flat = Box({5, 0, 0}, {6, 1, 1}, 3);
  flat.vertices.row(0).setConstant(5);
  const TriangleMesh frame = synthetic::Join(std::vector{Pool(), flat});
  TriangleMesh turned = frame;
  EXPECT_EQ(TurnPartsOutward(turned)->count, 0);
  EXPECT_EQ(turned.triangles, frame.triangles);
}

TEST_F(TurnPartsOutwardTest, SmallPartsFarFromTheOriginAreTurned) {
  const std::vector<TriangleMesh> parts = {Box({9000, 9000, 0}, {9004, 9004, 2}),
                                           Flipped(Drop({9001, 9001, 3}, 0.01))};
  CleanFrame(parts);
  EXPECT_THAT(FaceOutward(parts), ElementsAre(true, true));
}

// Each triangle is compared only with the parts beside it. With all, it takes 40 times as long as
// the rest.
TEST_F(TurnPartsOutwardTest, ThousandsOfBubblesAndDropsTakeNoLongerThanTheRestOfTheCleaning) {
  std::vector<TriangleMesh> parts = {Box({-1, -1, -2}, {41, 41, 2}, 60)};
  for (int i = 0; i < 40; ++i) {
    for (int j = 0; j < 40; ++j) {
      const auto x = static_cast<float>(i), y = static_cast<float>(j);
      parts.push_back(Flipped(Icosphere({x, y, 0}, 0.3, 1)));
      parts.push_back(Flipped(Icosphere({x, y, 4}, 0.3, 1)));
    }
  }
  TriangleMesh frame = synthetic::Join(parts);
  const auto cpu_seconds = [](const auto& work) {
    const std::clock_t begin = std::clock();
    work();
    return static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  };
  TriangleMesh turned = frame;
  const double turning = cpu_seconds([&] { EXPECT_EQ(TurnPartsOutward(turned)->count, 1600); });
  const double cleaning = cpu_seconds([&] { EXPECT_TRUE(Clean(frame).ok()); });
  EXPECT_LT(turning, 5 * cleaning);
}

// Without a limit a file of this kind with a million triangles would take minutes.
TEST_F(TurnPartsOutwardTest, AFileMadeToTakeLongIsRefused) {
  std::vector<TriangleMesh> parts = {Box({-40, -40, -40}, {40, 40, 40})};
  for (int n = 0; n < 2000; ++n) {
    const float size = 1 + 0.001f * static_cast<float>(n);
    parts.push_back(Flipped(Box({-size, -size, -size}, {size, size, size})));
  }
  TriangleMesh frame = synthetic::Join(parts);
  const absl::StatusOr<CleanCounts> counts = Clean(frame);
  EXPECT_EQ(counts.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(counts.status().message(),
              ::testing::HasSubstr("thousands of parts lie beside one another"));
}

// A spindle around z, between -1 and 1, at this y. Its rim goes up and down, so that each of its
// triangles is as high as the whole.
TriangleMesh TallTriangles(float y, int num_corners) {
  TriangleMesh mesh;
  mesh.vertices.resize(3, num_corners + 2);
  mesh.triangles.resize(3, 2 * num_corners);
  mesh.vertices.col(num_corners) << 0, y, -1;
  mesh.vertices.col(num_corners + 1) << 0, y, 1;
  for (int k = 0; k < num_corners; ++k) {
    const double angle = 2 * std::numbers::pi * k / num_corners;
    mesh.vertices.col(k) << static_cast<float>(std::cos(angle)),
        y + static_cast<float>(std::sin(angle)), k % 2 == 0 ? -0.9f : 0.9f;
    const int next = (k + 1) % num_corners;
    mesh.triangles.col(2 * k) << next, k, num_corners;
    mesh.triangles.col(2 * k + 1) << k, next, num_corners + 1;
  }
  return mesh;
}

TriangleMesh Tetrahedron(const Eigen::Vector3f& corner, float size) {
  TriangleMesh mesh;
  mesh.vertices.resize(3, 4);
  mesh.vertices << Eigen::Vector3f::Zero(), size * Eigen::Matrix3f::Identity();
  mesh.vertices.colwise() += corner;
  mesh.triangles.resize(3, 4);
  mesh.triangles << 0, 0, 0, 1,  //
      2, 1, 3, 2,                //
      1, 3, 2, 3;
  return mesh;
}

// The searches take long, though they find nothing: all drops are at the y of no other triangle.
TEST_F(TurnPartsOutwardTest, AFileMadeToSearchLongIsRefused) {
  std::vector<TriangleMesh> parts = {TallTriangles(/*y=*/9, 50'000)};
  for (int n = 0; n < 10'000; ++n) {
    const float z = -0.8f + 0.00016f * static_cast<float>(n);
    parts.push_back(Flipped(Tetrahedron({0, 0, z}, 0.0001f)));
  }
  TriangleMesh frame = synthetic::Join(parts);
  EXPECT_EQ(TurnPartsOutward(frame).status().code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace liquidblend::ingest::outward_test
