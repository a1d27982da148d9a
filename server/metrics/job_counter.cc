#include "server/metrics/job_counter.h"

#include <algorithm>
#include <string>
#include <vector>

#include "core/base/status_macros.h"
#include "core/store/catalog/job_records.h"

namespace liquidblend::metrics {
namespace {

using Job = store::pb::JobRecord;

// A job of an older program may not say when its work began.
EndedJob EndedJobOf(const Job& job) {
  EndedJob ended;
  ended.kind = job.has_import_animation() ? "import" : "registration";
  ended.code = static_cast<absl::StatusCode>(job.error().code());
  if (job.has_first_start_time()) {
    const absl::Time begin = store::ToTime(job.first_start_time());
    ended.waited = begin - store::ToTime(job.create_time());
    ended.worked = store::ToTime(job.update_time()) - begin;
  }
  const auto& attempts = job.failed_attempts();
  ended.num_lost = std::count_if(attempts.begin(), attempts.end(),
                                 [](const auto& attempt) { return attempt.worker_lost(); });
  ended.num_failed = job.failed_attempts_size() - ended.num_lost;
  return ended;
}

}  // namespace

absl::Status JobCounter::Update() {
  // Jobs that ended before are not counted: another look begins with the last end.
  const bool is_first = !last_end_.has_value();
  const absl::Time after = last_end_.value_or(absl::InfinitePast());
  LB_ASSIGN_OR_RETURN(const std::vector<Job> jobs,
                      catalog_.ListEndedJobs(after, is_first ? 1 : kMaxJobs));
  last_end_ = jobs.empty() ? after : store::ToTime(jobs.front().update_time());
  if (is_first) return absl::OkStatus();
  for (const Job& job : jobs) metrics_.CountJob(EndedJobOf(job));
  return absl::OkStatus();
}

}  // namespace liquidblend::metrics
