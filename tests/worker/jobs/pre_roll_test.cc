// Jobs whose source has a pre-roll: the family, its levels, refinements, and several targets.
#include "worker/jobs/pre_roll.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

#include "core/mesh/components.h"
#include "core/slice/slice.h"
#include "core/store/files/files.h"
#include "tests/synthetic/implicit.h"
#include "tests/synthetic/slice_family.h"
#include "tests/synthetic/surface_distance.h"
#include "tests/worker/jobs/jobs_testing.h"

namespace liquidblend::jobs::pre_roll_test {
namespace {

using store::Succeeds;

mesh::Animation Drop(double height_m, double bridge_radius_m, int num_frames = 16) {
  synthetic::FallingDropsOptions options;
  options.drops = {{{0, 0, height_m}, 0.25, 0, bridge_radius_m}};
  options.pool_half_width_m = {0.6, 0.5};
  options.num_frames = num_frames;
  return synthetic::FallingDrops(options);
}

int NumDrops(const mesh::RegisteredFamily& family, const std::vector<double>& weights,
             double frame) {
  const slice::CellIndex index(family);
  const mesh::TriangleMesh surface =
      synthetic::SliceFamily(index, weights, frame / family.frames_per_second);
  EXPECT_TRUE(mesh::CheckClosed(surface).closed());
  int count = 0;
  for (const mesh::Component& component : mesh::FindComponents(surface)) {
    count += component.volume > 0.02 && component.volume < 0.1 ? 1 : 0;
  }
  return count;
}

class PreRollTest : public JobsTest {
 protected:
  void Import() {
    SubmitImport("bridged", ingest::Files(Drop(0.4, 0.13), ingest::Format::kPly));
    SubmitImport("joined", ingest::Files(Drop(0.5, 0.13), ingest::Format::kPly));
    SubmitImport("free", ingest::Files(Drop(0.8, 0), ingest::Format::kPly));
    EXPECT_THAT(Work(), Succeeds());
  }

  mesh::RegisteredFamily Register(const std::vector<std::string>& targets,
                                  const std::function<void(store::pb::RegisterJob&)>& change = {}) {
    const std::string job =
        SubmitRegistration("drops", "bridged", targets, [&](store::pb::RegisterJob& registration) {
          registration.mutable_options()->set_max_iterations(10);
          registration.mutable_options()->set_sample_share(0.2);
          registration.mutable_space_time()->set_droplet_vertices(0);
          if (change) change(registration);
        });
    EXPECT_THAT(Work(), Succeeds());
    EXPECT_EQ(Job(job).state(), store::pb::JobRecord::SUCCEEDED) << Job(job).error().message();
    auto family = store::OpenFamily(*blobs_.Open(catalog_->GetFamily("drops")->blob()), "drops");
    EXPECT_THAT(family, Succeeds());
    return *std::move(family);
  }
};

TEST_F(PreRollTest, TheFamilyShowsTheDropThatIsApartInTheTarget) {
  Import();
  const mesh::RegisteredFamily family = Register({"free"});
  EXPECT_EQ(family.num_pre_roll, registration::kPreRollFrames);
  EXPECT_EQ(family.num_frames, 16);
  ASSERT_EQ(family.coarser_levels.size(), 2U);
  for (const mesh::RegisteredFamily* level :
       {&family, &family.coarser_levels[0], &family.coarser_levels[1]}) {
    EXPECT_EQ(level->num_pre_roll, registration::kPreRollFrames);
    EXPECT_EQ(NumDrops(*level, {0}, 0), 0);
    EXPECT_EQ(NumDrops(*level, {0.5}, 0), 1);
    EXPECT_EQ(NumDrops(*level, {1}, 0), 1);
    EXPECT_EQ(NumDrops(*level, {1}, 6), 1);
    EXPECT_EQ(NumDrops(*level, {0.5}, 12), 0);
  }
}

TEST_F(PreRollTest, AShortAnimationHasAShortOne) {
  constexpr int kNumFrames = 5;
  SubmitImport("bridged", ingest::Files(Drop(0.4, 0.13, kNumFrames), ingest::Format::kPly));
  SubmitImport("free", ingest::Files(Drop(0.8, 0, kNumFrames), ingest::Format::kPly));
  ASSERT_THAT(Work(), Succeeds());
  const mesh::RegisteredFamily family = Register({"free"});
  EXPECT_EQ(family.num_pre_roll, kNumFrames);
  EXPECT_EQ(family.num_frames, kNumFrames);
  EXPECT_EQ(NumDrops(family, {0}, 0), 0);
  EXPECT_EQ(NumDrops(family, {0.5}, 0), 1);
}

// Also between its first frames, where cells reach into the pre-roll.
TEST_F(PreRollTest, AtWeightZeroTheFamilyIsTheSource) {
  Import();
  const auto distances = [](const mesh::RegisteredFamily& family) {
    const slice::CellIndex index(family);
    const mesh::Animation source = Drop(0.4, 0.13);
    std::vector<double> found;
    for (const int frame : {0, 1, 5}) {
      const mesh::TriangleMesh surface =
          synthetic::SliceFamily(index, std::vector<double>{0}, frame / family.frames_per_second);
      found.push_back(synthetic::MeanSymmetricDistance(surface, source.frames[frame]) /
                      family.edge_length_m);
    }
    return found;
  };
  const auto with = distances(Register({"free"}));
  const auto without = distances(Register({"joined"}));
  for (size_t n = 0; n < with.size(); ++n) EXPECT_LT(with[n], without[n] + 0.02) << n;
}

TEST_F(PreRollTest, ARefinementHasItIfTheFamilyHas) {
  Import();
  const auto refine = [](store::pb::RegisterJob& job) { job.set_refine_version(1); };
  const mesh::RegisteredFamily first = Register({"free"});
  const mesh::RegisteredFamily refined = Register({"free"}, refine);
  EXPECT_EQ(refined.num_pre_roll, first.num_pre_roll);
  ASSERT_EQ(refined.vertices.size(), first.vertices.size());
  EXPECT_TRUE(std::equal(first.vertices.begin(), first.vertices.end(), refined.vertices.begin()));
  EXPECT_EQ(NumDrops(refined, {0.5}, 0), 1);
}

// Families of older programs have none.
TEST_F(PreRollTest, ARefinementHasNoneIfTheFamilyHasNone) {
  Import();
  const mesh::RegisteredFamily first = Register({"free"}, [](store::pb::RegisterJob& job) {
    job.mutable_options()->set_automatic_correspondences(false);
  });
  EXPECT_EQ(first.num_pre_roll, 0);
  const mesh::RegisteredFamily refined =
      Register({"free"}, [](store::pb::RegisterJob& job) { job.set_refine_version(1); });
  EXPECT_EQ(refined.num_pre_roll, 0);
  EXPECT_EQ(refined.vertices.size(), first.vertices.size());
}

TEST_F(PreRollTest, ATargetThatDoesNotHaveThePartDoesNotShowIt) {
  Import();
  const mesh::RegisteredFamily family = Register({"joined", "free"});
  EXPECT_EQ(family.num_pre_roll, registration::kPreRollFrames);
  EXPECT_EQ(NumDrops(family, {1, 0}, 0), 0);
  EXPECT_EQ(NumDrops(family, {0.5, 0}, 1), 0);
  EXPECT_EQ(NumDrops(family, {0, 1}, 0), 1);
  EXPECT_EQ(NumDrops(family, {0, 0.5}, 0), 1);
  for (const mesh::RegisteredFamily& level : family.coarser_levels) {
    EXPECT_EQ(NumDrops(level, {1, 0}, 0), 0);
    EXPECT_EQ(NumDrops(level, {0, 1}, 0), 1);
  }
}

TEST_F(PreRollTest, ATrackedMeshHasNone) {
  Import();
  const mesh::RegisteredFamily family = Register({"free"}, [](store::pb::RegisterJob& job) {
    job.mutable_space_time()->set_connectivity(store::pb::TRACKED);
  });
  EXPECT_EQ(family.num_pre_roll, 0);
}

}  // namespace
}  // namespace liquidblend::jobs::pre_roll_test
