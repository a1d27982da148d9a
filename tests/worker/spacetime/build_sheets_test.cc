// Sheets thinner than the grid's spacing, as Build() shows them.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstring>
#include <map>
#include <numeric>
#include <set>

#include "core/mesh/slice_at.h"
#include "tests/synthetic/inverted_share.h"
#include "tests/synthetic/sheet.h"
#include "worker/spacetime/build.h"
#include "worker/spacetime/field/triangle_tree.h"

namespace liquidblend::spacetime::build_sheets_test {
namespace {

constexpr int kNumFrames = 5;
constexpr double kSpacingEdges = mesh::kDefaultSpacingEdges;

struct Case {
  double thickness;  // of the sheet; spacings
  double bend_m;     // 0: flat
  Eigen::Vector3f normal;
  Eigen::Vector3f motion;  // spacings a frame
};

// Some 20 edges across.
struct MovingSheet {
  explicit MovingSheet(const Case& c) {
    synthetic::SheetOptions options = {.radius_m = 0.9, .bend_m = c.bend_m};
    edge_m = mesh::MeanEdgeLength(synthetic::Sheet(options));
    options.thickness_m = c.thickness * kSpacingEdges * edge_m;
    shape = synthetic::Sheet(options);
    edge_m = mesh::MeanEdgeLength(shape);
    const Eigen::Matrix3f turn =
        Eigen::Quaternionf::FromTwoVectors(Eigen::Vector3f::UnitZ(), c.normal).toRotationMatrix();
    shape.vertices = (turn * shape.vertices).eval();
    step_m = static_cast<float>(kSpacingEdges * edge_m) * c.motion;
    for (int k = 0; k < kNumFrames; ++k) {
      animation.frames.push_back(At(k));
      animation.frames.back().velocities = (24.0f * step_m).replicate(1, shape.num_vertices());
    }
  }
  mesh::TriangleMesh At(double frames) const {
    mesh::TriangleMesh moved = shape;
    moved.vertices.colwise() += static_cast<float>(frames) * step_m;
    return moved;
  }

  mesh::TriangleMesh shape;
  double edge_m = 0;
  Eigen::Vector3f step_m;
  mesh::Animation animation;
};

// Of the surface with vertices taken apart where only vertices of it touch: 2 for each part without
// holes through it.
int EulerCharacteristic(const mesh::TriangleMesh& mesh) {
  std::vector<int> fan(mesh.triangles.size());  // per corner of a triangle
  std::iota(fan.begin(), fan.end(), 0);
  const auto root = [&](int corner) {
    while (fan[corner] != corner) corner = fan[corner] = fan[fan[corner]];
    return corner;
  };
  std::map<std::pair<int, int>, int> begin_of;  // edge, as a triangle runs it -> its first corner
  const auto next = [](int corner) { return corner % 3 == 2 ? corner - 2 : corner + 1; };
  const auto vertex = [&](int corner) { return mesh.triangles(corner % 3, corner / 3); };
  for (int c = 0; c < static_cast<int>(fan.size()); ++c) {
    begin_of[{vertex(c), vertex(next(c))}] = c;
  }
  for (const auto& [edge, c] : begin_of) {
    const auto other = begin_of.find({edge.second, edge.first});
    if (other == begin_of.end()) continue;
    fan[root(next(other->second))] = root(c);
    fan[root(other->second)] = root(next(c));
  }
  std::set<int> fans;
  for (int c = 0; c < static_cast<int>(fan.size()); ++c) fans.insert(root(c));
  return static_cast<int>(fans.size()) - static_cast<int>(begin_of.size() / 2) +
         static_cast<int>(mesh.num_triangles());
}

double MeanDistance(const mesh::TriangleMesh& from, const mesh::TriangleMesh& to) {
  const TriangleTree tree(to);
  double sum = 0;
  for (int64_t v = 0; v < from.num_vertices(); ++v) sum += tree.Distance(from.vertices.col(v));
  return sum / static_cast<double>(from.num_vertices());
}

mesh::SpaceTimeMesh BuildOrDie(const mesh::Animation& animation, int num_threads = 2) {
  BuildOptions options;
  options.connectivity = Connectivity::kRebuilt;
  auto mesh = Build(animation, options, parallel::Arena(num_threads));
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  return *std::move(mesh);
}

struct Errors {
  double volume = 0;          // largest share, at frames
  double distance_edges = 0;  // largest mean, at any time
  double inverted_share = 0;  // of the crossings at all times
};

// Checks that the sheet is whole at frames and at five times between two.
Errors CheckWhole(const Case& c) {
  const MovingSheet sheet(c);
  const mesh::SpaceTimeMesh mesh = BuildOrDie(sheet.animation);
  EXPECT_TRUE(mesh::Validate(mesh).ok()) << mesh::Validate(mesh);
  std::vector<double> times = {0, 1, 2, 3, 4};
  for (int n = 0; n < 5; ++n) times.insert(times.end() - 2, 2.1 + 0.2 * n);
  const std::vector<mesh::TriangleMesh> slices = mesh::SliceAt(mesh, times, parallel::Arena(2));
  Errors errors;
  synthetic::CrossingCount crossings;
  for (size_t n = 0; n < times.size(); ++n) {
    const mesh::ClosednessReport report = mesh::CheckClosed(slices[n]);
    EXPECT_TRUE(report.closed()) << times[n];
    EXPECT_EQ(report.num_non_manifold_edges, 0) << times[n];
    EXPECT_EQ(mesh::NumComponents(slices[n]), 1) << times[n];
    EXPECT_EQ(EulerCharacteristic(slices[n]), 2) << times[n];
    const double error = mesh::Volume(slices[n]) / mesh::Volume(sheet.shape) - 1;
    if (times[n] == std::floor(times[n])) errors.volume = std::max(errors.volume, std::abs(error));
    crossings += synthetic::CountInverted(slices[n], 0.5 * sheet.edge_m);
    const mesh::TriangleMesh truth = sheet.At(times[n]);
    errors.distance_edges =
        std::max({errors.distance_edges, MeanDistance(slices[n], truth) / sheet.edge_m,
                  MeanDistance(truth, slices[n]) / sheet.edge_m});
  }
  errors.inverted_share = crossings.inverted_share();
  return errors;
}

const Eigen::Vector3f kNormals[] = {{0, 0, 1}, {0.2f, 0.35f, 1}, {1, 1, 0.1f}, {1, 1.1f, 0.95f}};

// Both thicknesses, flat and bent, in each direction.
void ExpectWhole(const Eigen::Vector3f& motion, double max_volume_error, double max_distance) {
  for (const double thickness : {0.3, 0.5}) {
    for (const double bend_m : {0.0, 1.0}) {
      for (const Eigen::Vector3f& normal : kNormals) {
        SCOPED_TRACE(testing::Message() << thickness << ' ' << bend_m << ' ' << normal.transpose());
        const Errors errors = CheckWhole({thickness, bend_m, normal, motion});
        EXPECT_LT(errors.volume, max_volume_error);
        EXPECT_LT(errors.distance_edges, max_distance);
        EXPECT_LT(errors.inverted_share, 1e-3);
      }
    }
  }
}

TEST(BuildSheets, AStillSheetIsWhole) { ExpectWhole({0, 0, 0}, 0.01, 0.04); }

TEST(BuildSheets, AMovingSheetIsWhole) { ExpectWhole({0.1f, 0.2f, 0.4f}, 0.02, 0.04); }

// Up to two spacings a frame and several times its thickness: its rim is shown a little off.
TEST(BuildSheets, AFastSheetIsWhole) {
  for (const double bend_m : {0.0, 1.0}) {
    for (const Eigen::Vector3f& normal : kNormals) {
      SCOPED_TRACE(testing::Message() << bend_m << ' ' << normal.transpose());
      const Errors errors = CheckWhole({0.4, bend_m, normal, {1.5f, 0.7f, 1.0f}});
      EXPECT_LT(errors.volume, 0.05);
      EXPECT_LT(errors.distance_edges, 0.1);
      EXPECT_LT(errors.inverted_share, 1e-3);
    }
  }
}

TEST(BuildSheets, SameBytesAtAnyThreadCount) {
  const MovingSheet sheet({0.3, 1.0, {0.2f, 0.35f, 1}, {0.1f, 0.2f, 0.4f}});
  const mesh::SpaceTimeMesh one = BuildOrDie(sheet.animation, 1);
  const mesh::SpaceTimeMesh eight = BuildOrDie(sheet.animation, 8);
  ASSERT_EQ(one.num_vertices(), eight.num_vertices());
  EXPECT_EQ(
      std::memcmp(one.vertices.data(), eight.vertices.data(), sizeof(float) * one.vertices.size()),
      0);
  EXPECT_EQ(one.hexahedra, eight.hexahedra);
}

}  // namespace
}  // namespace liquidblend::spacetime::build_sheets_test
