#include "core/store/catalog/figure_tables.h"

#include <algorithm>
#include <span>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/base/status_macros.h"
#include "core/store/catalog/catalog_tables.h"
#include "core/store/catalog/job_records.h"
#include "core/store/catalog/record_parts.h"

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

// Appends these jobs, the last to end first. They are found by their numbers, since any number of
// them may have ended at the same time.
absl::Status AppendEndedJobs(Sql& sql, std::span<const RecordLength<int64_t>> found,
                             std::vector<Job>& jobs) {
  const auto append_number = [](std::string* text, const RecordLength<int64_t>& row) {
    absl::StrAppend(text, row.key);
  };
  const std::string statement =
      absl::StrCat("SELECT record FROM jobs WHERE number IN (",
                   absl::StrJoin(found, ", ", append_number), ") ORDER BY ended_us DESC");
  return sql.Run(statement, {}, [&](const SqlRow& row) -> absl::Status {
    LB_ASSIGN_OR_RETURN(jobs.emplace_back(), ParseJob(sql, row.String(0)));
    DropLists(jobs.back());
    return absl::OkStatus();
  });
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
  std::vector<RecordLength<int64_t>> lengths;
  LB_RETURN_IF_ERROR(sql.Run(
      "SELECT number, length(record) FROM jobs WHERE ended_us > $1 ORDER BY ended_us DESC LIMIT $2",
      {absl::ToUnixMicros(after), int64_t{max_jobs}}, [&](const SqlRow& row) {
        lengths.push_back({row.Int(0), row.Int(1)});
        return absl::OkStatus();
      }));
  std::vector<Job> jobs;
  for (size_t begin = 0, end = 0; begin < lengths.size(); begin = end) {
    end = EndOfPart(lengths, begin, lengths.size());
    LB_RETURN_IF_ERROR(AppendEndedJobs(sql, std::span(lengths).subspan(begin, end - begin), jobs));
  }
  return jobs;
}

}  // namespace liquidblend::store
