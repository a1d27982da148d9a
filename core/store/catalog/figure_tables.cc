#include "core/store/catalog/figure_tables.h"

#include <algorithm>
#include <string>

#include "core/base/status_macros.h"
#include "core/store/catalog/catalog_tables.h"
#include "core/store/catalog/job_records.h"

namespace liquidblend::store {
namespace {

using Job = pb::JobRecord;

// Since the first submitted of the queued jobs that may be given out was queued. Nothing but being
// queued changes the record of a queued job.
absl::StatusOr<absl::Duration> OldestWait(Sql& sql, absl::Time now) {
  absl::Duration wait;
  LB_RETURN_IF_ERROR(sql.Run(
      "SELECT record FROM jobs WHERE state = $1 AND (due_us <= $2 OR due_us > $3) "
      "ORDER BY number LIMIT 1",
      {int64_t{Job::QUEUED}, absl::ToUnixMicros(now), absl::ToUnixMicros(now + kLongestLease)},
      [&](const SqlRow& row) -> absl::Status {
        LB_ASSIGN_OR_RETURN(const Job job, ParseJob(sql, row.String(0)));
        wait = std::max(absl::ZeroDuration(), now - ToTime(job.update_time()));
        return absl::OkStatus();
      }));
  return wait;
}

}  // namespace

absl::StatusOr<QueueFigures> MeasureQueue(Sql& sql, absl::Time now, int64_t memory_bytes) {
  QueueFigures figures;
  // A job that seems to be due beyond kLongestLease is due: the clock has been turned back.
  LB_RETURN_IF_ERROR(
      sql.Run("SELECT COUNT(CASE WHEN due_us > $1 AND due_us <= $2 THEN 1 END), "
              "COUNT(CASE WHEN memory_bytes > $3 THEN 1 END) FROM jobs WHERE state = $4",
              {absl::ToUnixMicros(now), absl::ToUnixMicros(now + kLongestLease), memory_bytes,
               int64_t{Job::QUEUED}},
              [&](const SqlRow& row) {
                figures.num_paused = row.Int(0);
                figures.num_too_large = row.Int(1);
                return absl::OkStatus();
              }));
  LB_ASSIGN_OR_RETURN(figures.oldest_wait, OldestWait(sql, now));
  return figures;
}

absl::StatusOr<std::vector<pb::JobRecord>> FindEndedJobs(Sql& sql, absl::Time after, int max_jobs) {
  std::vector<Job> jobs;
  LB_RETURN_IF_ERROR(sql.Run(
      "SELECT record FROM jobs WHERE ended_us > $1 ORDER BY ended_us DESC LIMIT $2",
      {absl::ToUnixMicros(after), int64_t{max_jobs}}, [&](const SqlRow& row) -> absl::Status {
        LB_ASSIGN_OR_RETURN(jobs.emplace_back(), ParseJob(sql, row.String(0)));
        return absl::OkStatus();
      }));
  return jobs;
}

}  // namespace liquidblend::store
