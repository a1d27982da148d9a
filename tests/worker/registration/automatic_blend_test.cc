// Scenes that closest points alone misalign.
#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <vector>

#include "core/mesh/slice_at.h"
#include "tests/synthetic/surface_distance.h"
#include "tests/worker/registration/drops_testing.h"
#include "tests/worker/registration/pillar_testing.h"
#include "tests/worker/registration/strike_testing.h"
#include "worker/registration/register.h"

namespace liquidblend::registration::automatic_blend_test {
namespace {

constexpr double kDropVolume = 0.0598;  // of the inputs' meshes; a true ball's is 0.0654
constexpr double kSameVolume = 0.05;    // as a share; what makes a drop a whole one

absl::StatusOr<Registration> RegisterScenes(const mesh::SpaceTimeMesh& source,
                                            const mesh::SpaceTimeMesh& target, bool automatic) {
  RegistrationOptions options;
  options.automatic_correspondences = automatic;
  options.sample_share = 0.2;  // the meshes are small
  options.max_iterations = 10;
  return Register(source, target, {}, options, parallel::Arena(2));
}

struct Ball {
  double volume_m3 = 0.0;
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();
};

// What is detached from the pool in the half-way blend at a frame, by x of its centre.
std::vector<Ball> BallsHalfWay(const mesh::SpaceTimeMesh& source, const Registration& registration,
                               double frame) {
  const double times[] = {frame};
  const Eigen::Matrix4Xf half = source.vertices + 0.5f * registration.displacement;
  const mesh::TriangleMesh slice = mesh::SliceAt(source, half, times, parallel::Arena(2))[0];
  std::vector<int> component(slice.num_vertices());
  for (size_t v = 0; v < component.size(); ++v) component[v] = static_cast<int>(v);
  const std::function<int(int)> root = [&](int v) {
    return component[v] == v ? v : component[v] = root(component[v]);
  };
  for (int64_t t = 0; t < slice.num_triangles(); ++t) {
    for (const int k : {1, 2}) {
      component[root(slice.triangles(k, t))] = root(slice.triangles(0, t));
    }
  }
  std::map<int, Ball> balls;
  for (int64_t t = 0; t < slice.num_triangles(); ++t) {
    const auto corner = [&](int k) -> Eigen::Vector3d {
      return slice.vertices.col(slice.triangles(k, t)).cast<double>();
    };
    const double volume = corner(0).dot(corner(1).cross(corner(2))) / 6;
    Ball& ball = balls[root(slice.triangles(0, t))];
    ball.volume_m3 += volume;
    ball.centre_m += volume / 4 * (corner(0) + corner(1) + corner(2));
  }
  std::vector<Ball> result;
  for (auto& [vertex, ball] : balls) {
    ball.centre_m /= ball.volume_m3;
    if (ball.volume_m3 > 0.1 * kDropVolume && ball.volume_m3 < 2 * kDropVolume) {
      result.push_back(ball);
    }
  }
  std::sort(result.begin(), result.end(),
            [](const Ball& a, const Ball& b) { return a.centre_m[0] < b.centre_m[0]; });
  return result;
}

bool IsWholeAt(const std::vector<Ball>& balls, const std::vector<Eigen::Vector3d>& centres_m,
               double edge_length_m) {
  if (balls.size() != centres_m.size()) return false;
  for (size_t n = 0; n < balls.size(); ++n) {
    if (std::abs(balls[n].volume_m3 / kDropVolume - 1) > kSameVolume) return false;
    if ((balls[n].centre_m - centres_m[n]).norm() > edge_length_m) return false;
  }
  return true;
}

// The drop is nearer to the pool than to the other animation's: it grabs the pool (section 6).
TEST(Automatic, ADropBesideTheOtherIsWholeHalfWayAndWasNot) {
  const mesh::SpaceTimeMesh source = Scene({DropAt(-0.6, 0.7)}), target = Scene({DropAt(0.6, 0.7)});
  const auto with = RegisterScenes(source, target, true);
  const auto without = RegisterScenes(source, target, false);
  ASSERT_TRUE(with.ok() && without.ok()) << with.status() << without.status();
  for (const double frame : {0.0, 3.0}) {
    const std::vector<Eigen::Vector3d> middle = {{0, 0, 0.7 - 0.05 * frame}};
    const double edge = source.edge_length_m;
    EXPECT_TRUE(IsWholeAt(BallsHalfWay(source, *with, frame), middle, edge)) << frame;
    EXPECT_FALSE(IsWholeAt(BallsHalfWay(source, *without, frame), middle, edge)) << frame;
  }
}

TEST(Automatic, TwoDropsDoNotSwapTheirPartners) {
  const mesh::SpaceTimeMesh source = Scene({DropAt(-0.9, 0.5), DropAt(0.1, 0.5)}, 1.4, 10);
  const mesh::SpaceTimeMesh target = Scene({DropAt(-0.1, 0.5), DropAt(0.9, 0.5)}, 1.4, 10);
  const auto with = RegisterScenes(source, target, true);
  const auto without = RegisterScenes(source, target, false);
  ASSERT_TRUE(with.ok() && without.ok()) << with.status() << without.status();
  const std::vector<Eigen::Vector3d> middle = {{-0.5, 0, 0.5}, {0.5, 0, 0.5}};
  const double edge = source.edge_length_m;
  EXPECT_TRUE(IsWholeAt(BallsHalfWay(source, *with, 0), middle, edge));
  EXPECT_FALSE(IsWholeAt(BallsHalfWay(source, *without, 0), middle, edge));
}

// It hangs for 15 frames first. It strikes at frame 9 and at frame 24: half-way at 16.5.
TEST(Automatic, ADropThatFallsFifteenFramesLaterStrikesHalfWayBetween) {
  const mesh::SpaceTimeMesh source = Scene({DropAt(0, 0.7)}, 0.5, 28);
  const mesh::SpaceTimeMesh target = Scene({DropAt(0, 0.7, 15)}, 0.5, 28);
  const auto with = RegisterScenes(source, target, true);
  const auto without = RegisterScenes(source, target, false);
  ASSERT_TRUE(with.ok() && without.ok()) << with.status() << without.status();
  const double late = 12;
  EXPECT_EQ(BallsHalfWay(source, *with, late).size(), 1u);
  EXPECT_EQ(BallsHalfWay(source, *without, late).size(), 0u);
}

// Twice its width away, so that what is nearest to one is the open water beside the other.
TEST(Automatic, APillarElsewhereStandsHalfWayBetween) {
  const mesh::SpaceTimeMesh source = BuildMesh(PoolAroundPillar({.x = -0.4}));
  const mesh::SpaceTimeMesh target = BuildMesh(PoolAroundPillar({.x = 0.4}));
  const mesh::Animation middle = PoolAroundPillar({.x = 0});
  const auto distance_edges = [&](bool automatic) {
    const auto registration = RegisterScenes(source, target, automatic);
    EXPECT_TRUE(registration.ok()) << registration.status();
    const double times[] = {6.0};
    const Eigen::Matrix4Xf half = source.vertices + 0.5f * registration->displacement;
    const auto slice = mesh::SliceAt(source, half, times, parallel::Arena(2))[0];
    return synthetic::MeanSymmetricDistance(slice, middle.frames[6]) / source.edge_length_m;
  };
  const double with = distance_edges(true), without = distance_edges(false);
  EXPECT_LT(with, 0.22);
  EXPECT_GT(without, 1.5 * with);
}

// Closest points slide along walls, so that the pool's surface would be carried along.
TEST(Automatic, AWakeThatIsCarriedFarLeavesThePoolsCornersWhereTheyAre) {
  const mesh::SpaceTimeMesh source = StrikeMesh({.x = -0.9, .crater_x = -0.9});
  const mesh::SpaceTimeMesh target = StrikeMesh({.x = 0.9, .crater_x = 0.9});
  const auto registration = RegisterScenes(source, target, true);
  ASSERT_TRUE(registration.ok()) << registration.status();
  const Eigen::Matrix4Xf half = source.vertices + 0.5f * registration->displacement;
  const std::vector<double> times = {2, 8, 14, 20};
  const auto at_rest = mesh::SliceAt(source, times, parallel::Arena(2));
  const auto slices = mesh::SliceAt(source, half, times, parallel::Arena(2));
  for (size_t n = 0; n < slices.size(); ++n) {
    for (const float x : {-1.37f, 1.37f}) {
      for (const float y : {-0.67f, 0.67f}) {
        const Eigen::Vector3f corner(x, y, -0.68f);
        const auto distance_m = [&](const mesh::TriangleMesh& slice) {
          return (slice.vertices.colwise() - corner).colwise().norm().minCoeff();
        };
        EXPECT_LT(distance_m(slices[n]), distance_m(at_rest[n]) + 0.5 * source.edge_length_m)
            << "frame " << times[n] << ", corner " << corner.transpose();
      }
    }
  }
}

}  // namespace
}  // namespace liquidblend::registration::automatic_blend_test
