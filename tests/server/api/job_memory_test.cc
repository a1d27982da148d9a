#include "server/api/job_memory.h"

#include <cmath>
#include <cstdio>
#include <fstream>
#include <string>

#include "tests/paths.h"
#include "tests/server/backends_testing.h"

namespace liquidblend::server {
namespace {

using store::Fails;
using store::Succeeds;
using store::v1::AnimationRecord;
using store::v1::RegisterJob;

AnimationRecord OfVertices(int64_t num_vertices) {
  AnimationRecord animation;
  animation.set_num_vertices(num_vertices);
  return animation;
}

// docs/experiments: what was seen, and no more than half as much again.
TEST(MemoryToRegister, IsWhatWasMeasured) {
  const int64_t small = MemoryToRegister({}, OfVertices(570'000), {OfVertices(600'000)});
  EXPECT_GT(small, 411'000'000);  // registration-speed.md
  EXPECT_LT(small, 800'000'000);
  const int64_t large = MemoryToRegister({}, OfVertices(4'200'000), {OfVertices(4'200'000)});
  EXPECT_GT(large, 4'400'000'000);  // large-animations.md
  EXPECT_LT(large, 6'600'000'000);
}

TEST(MemoryToRegister, IsThatOfTheLargestTarget) {
  const AnimationRecord source = OfVertices(1'000'000), target = OfVertices(3'000'000);
  EXPECT_EQ(MemoryToRegister({}, source, {source, target}), MemoryToRegister({}, source, {target}));
}

TEST(MemoryToRegister, GrowsWithFinerGridsAndWithManyTargets) {
  const AnimationRecord animation = OfVertices(1'000'000);
  RegisterJob coarse, fine;
  coarse.mutable_space_time()->set_spacing_edges(1.8);
  fine.mutable_space_time()->set_spacing_edges(0.45);
  const int64_t usual = MemoryToRegister({}, animation, {animation});
  EXPECT_LT(MemoryToRegister(coarse, animation, {animation}), usual / 2);
  EXPECT_GT(MemoryToRegister(fine, animation, {animation}), 7 * usual);
  const std::vector<AnimationRecord> many(16, animation);
  EXPECT_GT(MemoryToRegister({}, animation, many), 2 * usual);  // to put them together
}

TEST(MemoryToImport, GoesByTheFilesAndWhetherTheyArePacked) {
  store::v1::ImportJob job;
  const int64_t none = MemoryToImport(job);
  job.add_files()->set_size_bytes(1000);
  EXPECT_EQ(MemoryToImport(job) - none, 8'000);
  store::v1::SourceFile& packed = *job.add_files();
  packed.set_size_bytes(1000);
  packed.set_name("fluid_mesh_0001.bobj.gz");
  EXPECT_EQ(MemoryToImport(job) - none, 32'000);
}

AnimationRecord OfFrames(int num_frames, float extent_m) {
  AnimationRecord animation = OfVertices(int64_t{1000} * num_frames);
  store::v1::AnimationManifest& manifest = *animation.mutable_manifest();
  manifest.set_num_frames(num_frames);
  manifest.set_mean_edge_length_m(0.01);
  for (int k = 0; k < 3; ++k) {
    manifest.mutable_bounds()->add_min(0);
    manifest.mutable_bounds()->add_max(extent_m);
  }
  return animation;
}

TEST(MemoryToRegister, GrowsWithGridsOfWideAnimations) {
  const AnimationRecord usual = OfFrames(100, 1), wide = OfFrames(100, 10);
  EXPECT_LT(MemoryToRegister({}, usual, {usual}), 300'000'000);
  // A quarter of a bit for 1,111^3 points at 200 times.
  EXPECT_GT(MemoryToRegister({}, usual, {wide}), int64_t{1111} * 1111 * 1111 / 8 * 200 / 4);
  RegisterJob tracked;
  tracked.mutable_space_time()->set_connectivity(store::v1::TRACKED);
  EXPECT_EQ(MemoryToRegister(tracked, usual, {wide}), MemoryToRegister(tracked, usual, {usual}));
}

TEST(MemoryToRegister, GrowsWithFramesOfWideAnimations) {
  EXPECT_GT(MemoryToRegister({}, OfFrames(400, 10), {OfFrames(4, 1)}),
            4 * MemoryToRegister({}, OfFrames(40, 10), {OfFrames(4, 1)}));
}

TEST(MemoryToRegister, GrowsWithGapsBetweenFrames) {
  const AnimationRecord animation = OfVertices(1'000'000);
  AnimationRecord with_gap = animation;
  for (const double time : {0, 1, 101}) with_gap.mutable_manifest()->add_times(time);
  EXPECT_GT(MemoryToRegister({}, animation, {with_gap}),
            MemoryToRegister({}, animation, {animation}) + 2 * 1'400'000 * 4 * 60);
}

TEST(MemoryToRegister, GrowsWithLevelsOfDetail) {
  const AnimationRecord animation = OfVertices(1'000'000);
  const std::vector<AnimationRecord> many(16, animation);
  RegisterJob one, all;
  one.mutable_space_time()->set_coarser_levels(0);
  all.mutable_space_time()->set_coarser_levels(6);
  EXPECT_GT(MemoryToRegister(all, animation, many),
            1.8 * static_cast<double>(MemoryToRegister(one, animation, many)));
}

TEST(MemoryToRegister, NeverOverflows) {
  AnimationRecord absurd = OfFrames(2'000'000'000, 1e30F);
  EXPECT_GT(MemoryToRegister({}, absurd, {absurd}), int64_t{1} << 60);
}

// docs/operations/farms.md: a task has five fourths of the estimate, rounded up to whole GB.
TEST(MemoryToRegister, FitsIntoTheTasksThatThePageOfFarmsAdvises) {
  std::ifstream page(paths::Source("docs/operations/farms.md"));
  int num_rows = 0;
  for (std::string line; std::getline(page, line);) {
    double num_frames = 0, num_vertices_k = 0, task_gb = 0;
    if (std::sscanf(line.c_str(), "| %lf frames of %lfk vertices | %lf GB |", &num_frames,
                    &num_vertices_k, &task_gb) != 3) {
      continue;
    }
    ++num_rows;
    const AnimationRecord animation =
        OfVertices(static_cast<int64_t>(num_frames * num_vertices_k * 1e3));
    const double needed_gb =
        1.25e-9 * static_cast<double>(MemoryToRegister({}, animation, {animation}));
    EXPECT_EQ(task_gb, std::ceil(needed_gb)) << line;
  }
  EXPECT_EQ(num_rows, 2);
}

class JobMemoryTest : public RpcTest {
 protected:
  store::v1::JobRecord job_ = [] {
    store::v1::JobRecord job;
    job.mutable_import_animation()->add_files()->set_size_bytes(int64_t{1} << 30);
    return job;
  }();
};

TEST_F(JobMemoryTest, AJobThatIsTooLargeForTheServersWorkersIsRefusedWithTheEstimate) {
  const absl::Status refused = NoteMemory(*catalog_, int64_t{4} << 30, job_);
  EXPECT_THAT(refused,
              Fails(absl::StatusCode::kResourceExhausted,
                    "needs about 8.1 GiB of memory; the server's workers can hold 4.0 GiB"));
  EXPECT_TRUE(refused.GetPayload(kErrorInfoUrl).has_value());
  EXPECT_THAT(NoteMemory(*catalog_, int64_t{9} << 30, job_), Succeeds());
  EXPECT_GT(job_.memory_bytes(), int64_t{8} << 30);
  EXPECT_THAT(NoteMemory(*catalog_, 0, job_), Succeeds());  // who knows who comes
}

TEST_F(JobMemoryTest, AWorkerFromElsewhereMayTakeWhatTheServersOwnCannot) {
  ASSERT_TRUE(catalog_->LeaseJob("large", absl::Minutes(1), int64_t{16} << 30).ok());
  EXPECT_THAT(NoteMemory(*catalog_, int64_t{4} << 30, job_), Succeeds());
}

TEST_F(JobMemoryTest, TellsWhyAJobIsLeft) {
  job_.set_memory_bytes(int64_t{12} << 30);
  EXPECT_EQ(WaitsFor(job_, *catalog_->ListWorkers()), "no worker has asked for work lately");
  ASSERT_TRUE(catalog_->LeaseJob("small", absl::Minutes(1), int64_t{8} << 30).ok());
  EXPECT_EQ(WaitsFor(job_, *catalog_->ListWorkers()),
            "needs about 12.0 GiB of memory; no worker that asked lately can hold it");
  ASSERT_TRUE(catalog_->LeaseJob("large", absl::Minutes(1), int64_t{16} << 30).ok());
  EXPECT_EQ(WaitsFor(job_, *catalog_->ListWorkers()), "");
}

TEST_F(JobMemoryTest, TellsThatWorkersAreRefused) {
  job_.set_memory_bytes(int64_t{12} << 30);
  store::v1::WorkerRecord worker;
  worker.set_name("host:1");
  worker.set_memory_bytes(int64_t{16} << 30);
  worker.set_refusal("PUT s3://bucket/x: HTTP status 403, AccessDenied");
  ASSERT_TRUE(catalog_->RecordWorker(worker).ok());
  EXPECT_EQ(WaitsFor(job_, *catalog_->ListWorkers()),
            "workers take no jobs for now; host:1: PUT s3://bucket/x: HTTP status 403, "
            "AccessDenied");
  ASSERT_TRUE(catalog_->LeaseJob("large", absl::Minutes(1), int64_t{16} << 30).ok());
  EXPECT_EQ(WaitsFor(job_, *catalog_->ListWorkers()), "");
}

}  // namespace
}  // namespace liquidblend::server
