// The bundled simulations, as Blender's Mantaflow wrote them.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "core/mesh/animation.h"
#include "core/parallel/arena.h"
#include "tests/paths.h"
#include "worker/ingest/find_up.h"
#include "worker/ingest/read_animation.h"
#include "worker/ingest/read_directory.h"

namespace liquidblend::ingest::two_drops_test {
namespace {

using Eigen::Vector3d;

constexpr int kNumFrames = 72;
constexpr double kVoxelM = 0.0786;

mesh::Animation Read(const std::string& name) {
  const absl::StatusOr<std::vector<LoadedFile>> files =
      LoadDirectory(paths::Source("tests/data/two_drops/" + name));
  EXPECT_TRUE(files.ok()) << files.status();
  if (!files.ok()) return {};
  const parallel::Arena arena;
  absl::StatusOr<mesh::Animation> animation = ReadAnimation(name, Views(*files), {}, arena);
  EXPECT_TRUE(animation.ok()) << animation.status();
  return animation.ok() ? *std::move(animation) : mesh::Animation();
}

double SegmentDistance(const Vector3d& p, const Vector3d& a, const Vector3d& b) {
  const double along = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
  return (p - a - along * (b - a)).norm();
}

double TriangleDistance(const Vector3d& p, const Vector3d& a, const Vector3d& b,
                        const Vector3d& c) {
  const Vector3d normal = (b - a).cross(c - a);
  const bool is_above = (b - a).cross(p - a).dot(normal) >= 0 &&
                        (c - b).cross(p - b).dot(normal) >= 0 &&
                        (a - c).cross(p - c).dot(normal) >= 0;
  if (is_above && normal.norm() > 0) return std::abs((p - a).dot(normal.normalized()));
  return std::min({SegmentDistance(p, a, b), SegmentDistance(p, b, c), SegmentDistance(p, c, a)});
}

// Mean distance in voxels from every 97th vertex, moved by velocity * time_s, to a surface.
double MeanDistance(const mesh::TriangleMesh& from, double time_s, const mesh::TriangleMesh& to) {
  double sum = 0.0;
  int count = 0;
  for (Eigen::Index v = 0; v < from.vertices.cols(); v += 97) {
    const Vector3d p =
        from.vertices.col(v).cast<double>() + time_s * from.velocities.col(v).cast<double>();
    double closest = std::numeric_limits<double>::infinity();
    for (Eigen::Index t = 0; t < to.triangles.cols(); ++t) {
      closest =
          std::min(closest, TriangleDistance(p, to.vertices.col(to.triangles(0, t)).cast<double>(),
                                             to.vertices.col(to.triangles(1, t)).cast<double>(),
                                             to.vertices.col(to.triangles(2, t)).cast<double>()));
    }
    sum += closest;
    ++count;
  }
  return sum / count / kVoxelM;
}

class TwoDrops : public testing::TestWithParam<const char*> {};

TEST_P(TwoDrops, ReadsAllFramesClosedAndInMetres) {
  const mesh::Animation animation = Read(GetParam());
  ASSERT_EQ(animation.num_frames(), kNumFrames);
  EXPECT_EQ(animation.frames_per_second, 24.0);
  EXPECT_EQ(animation.first_frame_number, 1);
  for (const mesh::TriangleMesh& frame : animation.frames) {
    EXPECT_TRUE(mesh::CheckClosed(frame).closed());
    EXPECT_TRUE(mesh::Validate(frame).ok());
    EXPECT_EQ(frame.velocities.cols(), frame.num_vertices());
    // A tank of 4.4 m x 2.4 m filled 0.7 m high and two drops of radius 0.36 m are 7.8 m^3; FLIP
    // gains up to a quarter.
    EXPECT_GT(mesh::Volume(frame), 7.5);
    EXPECT_LT(mesh::Volume(frame), 9.8);
    EXPECT_LE(mesh::NumComponents(frame), 8);
  }
  EXPECT_NEAR(mesh::MeanEdgeLength(animation), 0.0853, 0.001);
  const Eigen::Matrix<float, 3, 2> bounds = mesh::Bounds(animation);
  const float longest_m = (bounds.col(1) - bounds.col(0)).maxCoeff();
  EXPECT_LT(longest_m, 4.4f);  // the domain
  EXPECT_GT(longest_m, 4.0f);
}

TEST_P(TwoDrops, LosesItsSlivers) {
  const mesh::Animation animation = Read(GetParam());
  int64_t num_slivers = 0;
  for (const mesh::TriangleMesh& frame : animation.frames) {
    for (Eigen::Index t = 0; t < frame.triangles.cols(); ++t) {
      const Vector3d a = frame.vertices.col(frame.triangles(0, t)).cast<double>();
      const Vector3d b = frame.vertices.col(frame.triangles(1, t)).cast<double>();
      const Vector3d c = frame.vertices.col(frame.triangles(2, t)).cast<double>();
      const double longest_m = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
      if ((b - a).cross(c - a).norm() <= 0.01 * longest_m * longest_m) ++num_slivers;
    }
  }
  EXPECT_LE(num_slivers, 10);  // of about 2,000; those hold the topology together
  ASSERT_FALSE(animation.notes.empty());
  EXPECT_EQ(animation.notes[0].substr(0, 8), "Removed ") << animation.notes[0];
}

TEST_P(TwoDrops, FallAgainstZ) {
  EXPECT_EQ(FindUp(Read(GetParam()), parallel::Arena(2)).up, mesh::Up::kZ);
}

INSTANTIATE_TEST_SUITE_P(All, TwoDrops, testing::Values("A", "B", "MID"),
                         [](const auto& param) { return std::string(param.param); });

TEST(TwoDropsVelocities, AreMetresPerSecond) {
  const mesh::Animation animation = Read("A");
  ASSERT_EQ(animation.num_frames(), kNumFrames);
  const double frame_s = 1.0 / animation.frames_per_second;
  double still = 0.0;
  double halfway = 0.0;
  double moved = 0.0;
  double too_far = 0.0;
  for (const int k : {10, 18}) {
    const mesh::TriangleMesh& from = animation.frames[k];
    const mesh::TriangleMesh& to = animation.frames[k + 1];
    still += MeanDistance(from, 0, to) / 2;
    halfway += MeanDistance(from, 0.5 * frame_s, to) / 2;
    moved += MeanDistance(from, frame_s, to) / 2;
    too_far += MeanDistance(from, 2 * frame_s, to) / 2;
  }
  // A wrong unit would put the closest approach at another multiple of a frame.
  EXPECT_LT(moved, 0.5 * still);
  EXPECT_LT(moved, halfway);
  EXPECT_LT(moved, too_far);
}

}  // namespace
}  // namespace liquidblend::ingest::two_drops_test
