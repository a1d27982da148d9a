// What finishing does to a real simulation; prints what it measures.
#include <gtest/gtest.h>

#include <cstdio>
#include <memory>
#include <string>

#include "core/finish/normals.h"
#include "core/finish/smooth_surface.h"
#include "tests/core/finish/finish_testing.h"
#include "tests/core/finish/height_probe.h"
#include "tests/paths.h"
#include "worker/ingest/read_animation.h"
#include "worker/ingest/read_directory.h"
#include "worker/spacetime/build.h"

namespace liquidblend::finish::two_drops_test {
namespace {

// Simulation A as a family without targets.
class TwoDropsTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    const parallel::Arena arena;
    const auto files = ingest::LoadDirectory(paths::Source("tests/data/two_drops/A"));
    ASSERT_TRUE(files.ok()) << files.status();
    auto animation = ingest::ReadAnimation("A", ingest::Views(*files), {}, arena);
    ASSERT_TRUE(animation.ok()) << animation.status();
    auto mesh = spacetime::Build(*animation, {}, arena);
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    animation_ = std::make_unique<mesh::Animation>(*std::move(animation));
    mesh_ = std::make_unique<mesh::SpaceTimeMesh>(*std::move(mesh));
  }
  static void TearDownTestSuite() {
    animation_.reset();
    mesh_.reset();
  }

  static float edge_m() { return static_cast<float>(mesh_->edge_length_m); }

  static std::unique_ptr<mesh::Animation> animation_;
  static std::unique_ptr<mesh::SpaceTimeMesh> mesh_;
};

std::unique_ptr<mesh::Animation> TwoDropsTest::animation_;
std::unique_ptr<mesh::SpaceTimeMesh> TwoDropsTest::mesh_;

// Frames 4 to 20 in slow motion, where what changes from one slice to the next is mostly flicker.
double FlickerOf(Slicer& slicer, const mesh::Animation& animation, const TemporalOptions& options,
                 float most_m) {
  const auto bounds = mesh::Bounds(animation);
  const Places places{bounds.col(0).head<2>(), bounds.col(1).head<2>()};
  std::vector<std::vector<float>> heights;
  for (double frame = 4.0; frame < 20.0; frame += 0.25) {
    heights.push_back(HeightsAbove(slicer.Cut({}, frame, options), places));
  }
  return Flicker(heights, most_m);
}

TEST_F(TwoDropsTest, TemporalSmoothingTakesFlickerOut) {
  Slicer slicer(mesh::ViewOf(*mesh_));
  const TemporalOptions full{1.0, 0.25 * edge_m()};
  const double before = FlickerOf(slicer, *animation_, {}, edge_m());
  const double after = FlickerOf(slicer, *animation_, full, edge_m());
  std::printf("flicker %.5f -> %.5f mean edges (x %.3f)\n", before / edge_m(), after / edge_m(),
              after / before);
  EXPECT_LT(after, 0.95 * before);

  double moved = 0.0;
  for (const double frame : {5.0, 17.5, 33.0, 60.0}) {
    const mesh::TriangleMesh plain = slicer.Cut({}, frame);
    const mesh::TriangleMesh smooth = slicer.Cut({}, frame, full);
    ASSERT_EQ(smooth.num_vertices(), plain.num_vertices());
    EXPECT_TRUE(mesh::CheckClosed(smooth).closed());
    const Eigen::VectorXf offsets = (smooth.vertices - plain.vertices).colwise().norm();
    EXPECT_LE(offsets.maxCoeff(), 0.2501F * edge_m());
    moved += offsets.mean() / 4;
  }
  std::printf("vertices moved by %.4f mean edges on average\n", moved / edge_m());
  EXPECT_LT(moved, 0.05 * edge_m());
}

TEST_F(TwoDropsTest, SmoothingRemovesSliversAndTaubinKeepsTheVolume) {
  Slicer slicer(mesh::ViewOf(*mesh_));
  for (const double frame : {10.3, 40.3}) {
    const mesh::TriangleMesh plain = slicer.Cut({}, frame);
    const auto change_by = [&](SmoothingKind kind) {
      mesh::TriangleMesh smooth = plain;
      SmoothSurface({1, kind}, smooth);
      EXPECT_TRUE(mesh::CheckClosed(smooth).closed());
      return mesh::Volume(smooth) / mesh::Volume(plain) - 1.0;
    };
    const double laplacian = change_by(SmoothingKind::kLaplacian);
    const double taubin = change_by(SmoothingKind::kTaubin);
    std::printf(
        "frame %.1f: one pass changes the volume by %.3f %% (Laplacian), %.3f %% (Taubin)\n", frame,
        100 * laplacian, 100 * taubin);
    EXPECT_LT(std::abs(laplacian), 0.006);
    EXPECT_LT(std::abs(taubin), 0.0005);
  }
}

struct VelocityErrors {
  double all = 0.0;     // m/s
  double normal = 0.0;  // of the part along the normal
};

// Against the simulation's own velocity at the nearest vertex of the frame.
VelocityErrors MeanErrors(mesh::TriangleMesh surface, const mesh::TriangleMesh& truth) {
  AddNormals(surface);
  VelocityErrors errors;
  int count = 0;
  for (Eigen::Index v = 0; v < surface.num_vertices(); v += 5) {
    Eigen::Index nearest = 0;
    (truth.vertices.colwise() - surface.vertices.col(v)).colwise().squaredNorm().minCoeff(&nearest);
    const Eigen::Vector3f error = surface.velocities.col(v) - truth.velocities.col(nearest);
    errors.all += error.norm();
    errors.normal += std::abs(error.dot(surface.normals.col(v)));
    ++count;
  }
  return {errors.all / count, errors.normal / count};
}

TEST_F(TwoDropsTest, VelocitiesAreTheSimulationsAndTheSlopeAgreesAlongTheNormal) {
  mesh::RegisteredFamily unknowing = mesh::ViewOf(*mesh_);
  unknowing.velocities = {};
  Slicer simulation(mesh::ViewOf(*mesh_));
  Slicer slope(unknowing);
  VelocityErrors own, smoothed, sloped;
  double speed = 0.0;
  for (const int frame : {6, 14, 22, 30, 45, 60}) {
    const mesh::TriangleMesh& truth = animation_->frames[frame];
    const auto errors = [&](Slicer& slicer, const TemporalOptions& temporal) {
      mesh::TriangleMesh surface = slicer.Cut({}, frame, temporal);
      slicer.AddVelocitiesTo(surface);
      return MeanErrors(surface, truth);
    };
    own.all += errors(simulation, {}).all / 6;
    smoothed.all += errors(simulation, {1.0, 0.25 * edge_m()}).all / 6;
    sloped.normal += errors(slope, {}).normal / 6;
    speed += truth.velocities.colwise().norm().mean() / 6;
  }
  std::printf(
      "mean error %.3f m/s; of the slope, along the normal, %.3f m/s; mean speed %.3f m/s\n",
      own.all, sloped.normal, speed);
  EXPECT_LT(own.all, 0.06);
  EXPECT_LT(smoothed.all, 0.06);  // smoothing in time does not touch them
  EXPECT_LT(sloped.normal, 0.12);
  EXPECT_GT(speed, 0.4);
}

}  // namespace
}  // namespace liquidblend::finish::two_drops_test
