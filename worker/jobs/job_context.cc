#include "worker/jobs/job_context.h"

#include <algorithm>

#include "absl/time/clock.h"
#include "worker/registration/fit/state.h"

namespace liquidblend::jobs {
namespace {

// Share of the work from which on the time left is estimated.
constexpr double kMinShareForEstimate = 0.05;

}  // namespace

JobContext::JobContext(store::Catalog& job_catalog, store::BlobStore& job_blobs,
                       const parallel::Arena& job_arena, LeaseKeeper& job_keeper,
                       Checkpoints& job_checkpoints, TracedAttempt& job_trace)
    : catalog(job_catalog),
      blobs(job_blobs),
      arena(job_arena),
      keeper(job_keeper),
      checkpoints(job_checkpoints),
      trace(job_trace),
      start_(absl::Now()) {}

absl::Status JobContext::BeginStage(const std::string& name, double begin, double end) {
  SetStage(name);
  stage_begin_ = begin;
  stage_end_ = end;
  if (!first_fraction_) first_fraction_ = begin;
  ReportFraction(0.0);
  return keeper.Check();
}

std::function<void(double)> JobContext::StageProgress() {
  return [this](double fraction) { ReportFraction(fraction); };
}

registration::ProgressCallback JobContext::RegistrationProgress(int target_index) {
  return [this, target_index](const registration::IterationReport& report) {
    set_target_index(target_index);
    progress_.set_iteration(report.iteration);
    progress_.set_num_iterations(report.num_iterations);
    progress_.set_fit_energy(report.fit_energy);
    progress_.set_smoothness_energy(report.smoothness_energy);
    progress_.set_num_inliers(report.num_inliers);
    progress_.set_num_samples(report.num_samples);
    const bool is_last = report.iteration >= report.num_iterations;
    const std::string stage = is_last ? "projection" : "registration";  // there may be several
    if (stage != progress_.stage()) SetStage(stage);
    ReportFraction(static_cast<double>(report.iteration) / std::max(1, report.num_iterations));
    return keeper.Check().ok();
  };
}

void JobContext::SetResumed(const registration::IterationReport& last, double share) {
  progress_.set_resumed_iteration(last.iteration);
  if (last.iteration > 0) trace.NoteResumed(last.iteration);
  progress_.set_iteration(last.iteration);
  progress_.set_num_iterations(last.num_iterations);
  const double before = progress_.fraction();
  ReportFraction(share);
  first_fraction_ = first_fraction_.value_or(0.0) + progress_.fraction() - before;
}

void JobContext::SetStage(const std::string& name) {
  progress_.set_stage(name);
  trace.BeginStage(name);
}

void JobContext::ReportFraction(double stage_fraction) {
  const double fraction =
      stage_begin_ + std::clamp(stage_fraction, 0.0, 1.0) * (stage_end_ - stage_begin_);
  const double elapsed_s = absl::ToDoubleSeconds(absl::Now() - start_);
  progress_.set_fraction(std::max(progress_.fraction(), fraction));
  progress_.set_seconds_elapsed(elapsed_s);
  const double done = progress_.fraction() - first_fraction_.value_or(0.0);
  const double left = 1.0 - progress_.fraction();
  const bool is_known = done > 0.0 && done >= kMinShareForEstimate * (done + left);
  progress_.set_seconds_left(is_known ? elapsed_s * left / done : 0.0);
  keeper.Report(progress_);
}

}  // namespace liquidblend::jobs
