// Context of a job's stages: the stores, the threads, and the reporting of progress.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "core/parallel/arena.h"
#include "core/store/blobs/blob_store.h"
#include "core/store/catalog/catalog.h"
#include "worker/jobs/attempt/lease_keeper.h"
#include "worker/jobs/attempt/traced_attempt.h"
#include "worker/jobs/checkpoints.h"
#include "worker/registration/register.h"

namespace liquidblend::jobs {

// Threads: stages begin and report one at a time; the stores, the arena and the keeper may be used
// by several threads.
class JobContext {
 public:
  JobContext(store::Catalog& job_catalog, store::BlobStore& job_blobs,
             const parallel::Arena& job_arena, LeaseKeeper& job_keeper,
             Checkpoints& job_checkpoints, TracedAttempt& job_trace);

  store::Catalog& catalog;
  store::BlobStore& blobs;
  const parallel::Arena& arena;
  LeaseKeeper& keeper;
  Checkpoints& checkpoints;
  TracedAttempt& trace;

  // Begins the next stage, which covers the job's progress from fraction `begin` to `end`.
  // Errors: keeper.Check()'s, if the job is not to go on.
  absl::Status BeginStage(const std::string& name, double begin, double end);

  // Progress callback for the stage's function, with the stage's own fraction, 0 to 1.
  std::function<void(double)> StageProgress();

  // Sets the target of the following reports.
  void set_target_index(int target_index) { progress_.set_target_index(target_index); }

  // Progress callback for Register() of one target; it cancels when the job is not to go on. The
  // stage is called "projection" after the last iteration.
  registration::ProgressCallback RegistrationProgress(int target_index);

  // Marks the registration as resumed after this iteration. Work done before, `share` of the stage,
  // is left out of the time estimate.
  void SetResumed(const registration::IterationReport& last, double share);

  const std::string& stage() const { return progress_.stage(); }

 private:
  void SetStage(const std::string& name);
  void ReportFraction(double stage_fraction);

  const absl::Time start_;
  std::optional<double> first_fraction_;  // progress at the start of this attempt
  store::pb::JobProgress progress_;
  double stage_begin_ = 0.0;
  double stage_end_ = 0.0;
};

}  // namespace liquidblend::jobs
