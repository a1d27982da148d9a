// Animations whose liquid touches itself along edges and in vertices, as ingest hands them over.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "core/slice/slice.h"
#include "tests/synthetic/slice_family.h"
#include "tests/synthetic/voxels.h"
#include "worker/ingest/clean/clean.h"
#include "worker/spacetime/build.h"

namespace liquidblend::spacetime::touching_test {
namespace {

using testing::AllOf;
using testing::DoubleNear;
using testing::Each;
using testing::SizeIs;

constexpr int kNumFrames = 5;
constexpr size_t kNumSlices = 2 * kNumFrames - 1;  // at frames and half-way between them
constexpr int kNumPerSide = 5;
constexpr float kStepX = 0.2f;  // cubes a frame

mesh::TriangleMesh CleanFrame(const synthetic::Voxels& voxels, int k) {
  mesh::TriangleMesh frame = synthetic::VoxelSurface(voxels);
  EXPECT_GT(mesh::CheckClosed(frame).num_non_manifold_edges, 0) << k;
  frame.vertices.row(0).array() += kStepX * static_cast<float>(k);
  frame.velocities = Eigen::Vector3f(24 * kStepX, 0, 0).replicate(1, frame.num_vertices());
  const absl::StatusOr<ingest::CleanCounts> counts = ingest::Clean(frame);
  EXPECT_TRUE(counts.ok()) << counts.status();
  return frame;
}

// Random cubes that drift along x; `num_changes` of them appear or disappear in each frame.
mesh::Animation DriftingCubes(int num_changes) {
  mesh::Animation animation;
  synthetic::Voxels voxels = synthetic::RandomVoxels(kNumPerSide, 0.5, 3);
  for (int k = 0; k < kNumFrames; ++k) {
    animation.frames.push_back(CleanFrame(voxels, k));
    for (int i = 0; i < num_changes; ++i) {
      voxels.is_liquid[(37 * k + 11 * i) % voxels.is_liquid.size()].flip();
    }
  }
  return animation;
}

// Checks the mesh and its slices at frames and half-way between them. Returns the slices' volumes
// as shares of the frame's, or of the mean of the two around it.
std::vector<double> BuildAndCut(const mesh::Animation& animation, Connectivity connectivity) {
  BuildOptions options;
  options.connectivity = connectivity;
  options.droplet_vertices = 0;  // a cube has 8
  options.spacing_edges = 0.5;
  const auto mesh = Build(animation, options, parallel::Arena(2));
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  if (!mesh.ok()) return {};
  EXPECT_TRUE(mesh::Validate(*mesh).ok()) << mesh::Validate(*mesh);
  const mesh::RegisteredFamily family = mesh::ViewOf(*mesh);
  const slice::CellIndex index(family);
  std::vector<double> volume_shares;
  for (int half = 0; half <= 2 * (kNumFrames - 1); ++half) {
    const mesh::TriangleMesh surface = synthetic::SliceFamily(index, {}, half / 48.0);
    EXPECT_TRUE(mesh::CheckClosed(surface).closed()) << half;
    const double volume = (mesh::Volume(animation.frames[half / 2]) +
                           mesh::Volume(animation.frames[(half + 1) / 2])) /
                          2;
    volume_shares.push_back(mesh::Volume(surface) / volume);
  }
  return volume_shares;
}

TEST(Touching, TrackedFramesComeBackExactly) {
  EXPECT_THAT(BuildAndCut(DriftingCubes(0), Connectivity::kTracked),
              AllOf(SizeIs(kNumSlices), Each(DoubleNear(1.0, 1e-5))));
}

TEST(Touching, TrackedFramesWhoseTopologyChangesStayClosed) {
  const std::vector<double> shares = BuildAndCut(DriftingCubes(3), Connectivity::kTracked);
  ASSERT_EQ(shares.size(), kNumSlices);
  for (size_t half = 0; half < shares.size(); ++half) {
    EXPECT_NEAR(shares[half], 1.0, half % 2 == 0 ? 1e-5 : 0.05);
  }
}

TEST(Touching, RebuiltFramesStayClosedAndKeepTheirVolume) {
  for (const int num_changes : {0, 3}) {
    EXPECT_THAT(BuildAndCut(DriftingCubes(num_changes), Connectivity::kRebuilt),
                AllOf(SizeIs(kNumSlices), Each(DoubleNear(1.0, 0.05))))
        << num_changes;
  }
}

}  // namespace
}  // namespace liquidblend::spacetime::touching_test
