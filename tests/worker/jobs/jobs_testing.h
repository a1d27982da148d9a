// A store in a temporary folder with a clock of its own, and jobs to put into it.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/synchronization/mutex.h"
#include "absl/time/clock.h"
#include "core/mesh/animation.h"
#include "core/parallel/arena.h"
#include "core/store/blobs/blob_store.h"
#include "core/store/catalog/catalog.h"
#include "core/store/data_directory.h"
#include "core/store/sql/sqlite.h"
#include "tests/core/store/blobs/hooked_blobs.h"
#include "tests/core/store/store_testing.h"
#include "tests/synthetic/shapes.h"
#include "tests/worker/ingest/formats/encode_files.h"
#include "worker/jobs/run_jobs.h"

namespace liquidblend::jobs {

using store::HookedBlobs;

class JobsTest : public testing::Test {
 protected:
  JobsTest() : blobs_(*store::OpenLocalBlobStore(folder_.path())) {
    store::CatalogOptions options;
    options.retry.first_pause = absl::ZeroDuration();
    options.now = [this] {
      if (on_clock_) on_clock_();
      return start_ + absl::Milliseconds(clock_ms_.load());
    };
    catalog_ = *store::OpenSqliteCatalog(store::CatalogPath(folder_.path()), options);
  }

  // A ball of 162 vertices that moves along x for 4 frames.
  static mesh::Animation Ball(double velocity_m_per_s, double frames_per_second = 24) {
    synthetic::MovingSphereOptions options;
    options.velocity_m_per_s = {static_cast<float>(velocity_m_per_s), 0, 0};
    options.frames_per_second = frames_per_second;
    options.num_frames = 4;
    options.subdivisions = 2;
    return synthetic::MovingSphere(options);
  }

  std::string SubmitImport(const std::string& id, const std::vector<ingest::LoadedFile>& files,
                           double frames_per_second = 24) {
    store::pb::AnimationRecord animation;
    animation.set_id(id);
    store::pb::JobRecord job;
    job.mutable_import_animation()->set_animation(id);
    job.mutable_import_animation()->mutable_options()->set_frames_per_second(frames_per_second);
    for (const ingest::LoadedFile& file : files) {
      store::pb::SourceFile& record = *job.mutable_import_animation()->add_files();
      record.set_name(file.name);
      record.set_blob(*store::PutBlob(blobs_, file.bytes));
      record.set_size_bytes(static_cast<int64_t>(file.bytes.size()));
    }
    const auto submitted = catalog_->SubmitImport(animation, job);
    EXPECT_TRUE(submitted.ok()) << submitted.status();
    return submitted->id();
  }

  std::string SubmitBall(const std::string& id, double velocity_m_per_s,
                         double frames_per_second = 24) {
    return SubmitImport(
        id, ingest::Files(Ball(velocity_m_per_s, frames_per_second), ingest::Format::kPly),
        frames_per_second);
  }

  std::string SubmitRegistration(const std::string& family, const std::string& source,
                                 const std::vector<std::string>& targets,
                                 const std::function<void(store::pb::RegisterJob&)>& change = {}) {
    store::pb::JobRecord job;
    store::pb::RegisterJob& registration = *job.mutable_register_family();
    registration.set_family(family);
    registration.set_source(source);
    for (const std::string& target : targets) registration.add_targets(target);
    registration.mutable_options()->set_max_iterations(3);
    if (change) change(registration);
    const auto submitted = catalog_->SubmitRegistration(job);
    EXPECT_TRUE(submitted.ok()) << submitted.status();
    return submitted->id();
  }

  static JobLoopOptions Options() {
    JobLoopOptions options;
    options.worker = "test";
    options.idle_time = absl::ZeroDuration();
    options.lease.report_interval = absl::Milliseconds(5);
    options.access = {absl::Milliseconds(1), absl::Milliseconds(4)};
    return options;
  }

  // Works until the queue is empty.
  absl::Status Work(int num_threads = 2, const std::string& worker = "test") {
    JobLoopOptions options = Options();
    options.worker = worker;
    return WorkWith(options, num_threads);
  }
  absl::Status WorkWith(const JobLoopOptions& options, int num_threads = 2) {
    const parallel::Arena arena(num_threads);
    return RunJobs(*catalog_, blobs_, arena, stop_, options).status();
  }

  // Registration as older programs, which had no children, left it: one queued job.
  void MakeOneJobOf(const std::string& job_id) {
    store::pb::JobRecord job = Job(job_id);
    job.set_state(store::pb::JobRecord::QUEUED);
    const auto db = *store::Database::Open(store::CatalogPath(folder_.path()), absl::Seconds(10));
    EXPECT_THAT(db->Run("DELETE FROM jobs WHERE parent = ?", {job_id}), store::Succeeds());
    EXPECT_THAT(db->Run("UPDATE jobs SET state = ?, due_us = 0, record = ? WHERE id = ?",
                        {int64_t{job.state()}, store::Bytes{job.SerializeAsString()}, job_id}),
                store::Succeeds());
  }

  store::pb::JobRecord Job(const std::string& id) { return *catalog_->GetJob(id); }

  // Waits until this becomes true; it must within a minute.
  static void Await(const std::function<bool()>& condition) {
    const absl::Time deadline = absl::Now() + absl::Minutes(1);
    while (!condition()) {
      ASSERT_LT(absl::Now(), deadline) << "did not happen";
      absl::SleepFor(absl::Milliseconds(1));
    }
  }

  const absl::Time start_ = absl::FromUnixSeconds(1'700'000'000);
  std::atomic<int64_t> clock_ms_ = 0;  // of the catalog
  std::function<void()> on_clock_;     // called by any thread in each change of the catalog
  store::TemporaryFolder folder_;
  HookedBlobs blobs_;
  std::unique_ptr<store::Catalog> catalog_;
  StopSignal stop_;
};

}  // namespace liquidblend::jobs
