// The levels of detail of a registered family, as the server loads and slices them.
#include <gtest/gtest.h>

#include <cstdio>

#include "core/slice/slice.h"
#include "core/store/files/files.h"
#include "tests/synthetic/implicit.h"
#include "tests/synthetic/slice_family.h"
#include "tests/synthetic/surface_distance.h"
#include "tests/worker/jobs/jobs_testing.h"

namespace liquidblend::jobs {
namespace {

using store::Succeeds;

class LevelsTest : public JobsTest {
 protected:
  // Two drops that fall into a pool, one lower than the other, registered to one another.
  mesh::RegisteredFamily RegisteredDrops() {
    synthetic::FallingDropOptions low;
    synthetic::FallingDropOptions high;
    high.drop_m = {0, 0, 0.65F};
    SubmitImport("low", ingest::Files(synthetic::FallingDrop(low), ingest::Format::kPly));
    SubmitImport("high", ingest::Files(synthetic::FallingDrop(high), ingest::Format::kPly));
    EXPECT_THAT(Work(), Succeeds());
    const std::string job = SubmitRegistration("drops", "low", {"high"});
    EXPECT_THAT(Work(), Succeeds());
    EXPECT_EQ(Job(job).state(), store::pb::JobRecord::SUCCEEDED) << Job(job).error().message();
    record_ = *catalog_->GetFamily("drops");
    auto family = store::OpenFamily(*blobs_.Open(record_.blob()), "drops");
    EXPECT_THAT(family, Succeeds());
    return *std::move(family);
  }

  store::pb::FamilyRecord record_;
};

mesh::TriangleMesh Cut(const mesh::RegisteredFamily& family, double weight, double frame) {
  const slice::CellIndex index(family);
  const double time_s = std::min(frame / family.frames_per_second, family.duration_s());
  return synthetic::SliceFamily(index, std::vector{weight}, time_s);
}

TEST_F(LevelsTest, AreSmallerClosedAndCloseToTheFinest) {
  const mesh::RegisteredFamily family = RegisteredDrops();
  ASSERT_EQ(family.coarser_levels.size(), 2U);
  EXPECT_EQ(family.velocities.size(), family.vertices.size());
  ASSERT_EQ(record_.manifest().coarser_levels_size(), 2);
  EXPECT_TRUE(record_.manifest().has_velocities());
  for (int k = 0; k < 2; ++k) {
    const mesh::RegisteredFamily& level = family.coarser_levels[k];
    const double share =
        static_cast<double>(level.vertices.size()) / static_cast<double>(family.vertices.size());
    EXPECT_NEAR(share, k == 0 ? 0.5 : 0.25, k == 0 ? 0.1 : 0.07);
    EXPECT_EQ(level.velocities.size(), level.vertices.size());
    EXPECT_EQ(record_.manifest().coarser_levels(k).num_vertices(),
              static_cast<int64_t>(level.vertices.size()));
    double distance = 0.0;
    for (const double weight : {0.0, 0.5, 1.0}) {
      for (const double frame : {0.0, 3.4, 8.0, 15.0}) {
        const mesh::TriangleMesh coarse = Cut(level, weight, frame);
        EXPECT_TRUE(mesh::CheckClosed(coarse).closed()) << weight << " at " << frame;
        distance += synthetic::MeanSymmetricDistance(coarse, Cut(family, weight, frame)) /
                    family.edge_length_m / 12;
      }
    }
    std::printf("level %d: %.3f of the vertices, mean distance to level 0 %.3f mean edges\n", k + 1,
                share, distance);
    EXPECT_LT(distance, k == 0 ? 0.1 : 0.2);
    for (const double weight : {-0.5, 1.5}) {
      for (const double frame : {0.0, 7.7, 15.0}) {
        EXPECT_TRUE(mesh::CheckClosed(Cut(level, weight, frame)).closed());
      }
    }
  }
}

}  // namespace
}  // namespace liquidblend::jobs
