#include "core/store/catalog/next_job.h"

#include <algorithm>
#include <string>
#include <tuple>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace liquidblend::store {
namespace {

// Parts of statements for jobs and children that may be leased, now or later: what follows "FROM
// jobs" to read them by an index. jobs_queued_by_turn has them in the order in which they are
// leased, the others by due time. No index has jobs of both states: each heartbeat of a running job
// leaves an old entry, which a search for a queued one would have to pass.
std::string OfIndex(const Sql& sql, const char* index, pb::JobRecord::State state) {
  return absl::StrCat(sql.indexed_by(index), " WHERE state = ", state);
}
std::string Queued(const Sql& sql) {
  return OfIndex(sql, "jobs_queued_by_turn", pb::JobRecord::QUEUED);
}
std::string QueuedByDue(const Sql& sql) {
  return OfIndex(sql, "jobs_queued_by_due", pb::JobRecord::QUEUED);
}
std::string Running(const Sql& sql) {
  return OfIndex(sql, "jobs_running_by_due", pb::JobRecord::RUNNING);
}

// Finds the first job in the order of leases with `condition`. See FindJobToDo().
absl::StatusOr<std::optional<JobRow>> FindFirstDue(Sql& sql, const std::string& condition,
                                                   absl::Time now, int64_t memory_bytes) {
  return FindJobRow(
      sql,
      absl::StrCat(condition, " AND (due_us <= $1 OR due_us > $2) AND memory_bytes <= $3 ",
                   "ORDER BY priority DESC, turn, number LIMIT 1", sql.for_update_of_free()),
      {absl::ToUnixMicros(now), absl::ToUnixMicros(now + kLongestLease), memory_bytes});
}

// Whether a job of at most memory_bytes has a lease that has ended, or ends so late that the clock
// must have been turned back. Heartbeats leave old entries in the index, which a long snapshot
// keeps from being removed. The bounds skip those whose lease would still last without the renewal.
absl::StatusOr<bool> HasLostJob(Sql& sql, absl::Time now, int64_t memory_bytes) {
  const std::string of_running =
      absl::StrCat("(due_us) FROM jobs ", Running(sql), " AND memory_bytes <= $1 AND due_us ");
  LB_ASSIGN_OR_RETURN(
      const int64_t has_lost,
      QueryInt(sql,
               absl::StrCat("SELECT CASE WHEN COALESCE((SELECT MIN", of_running,
                            "<= $2), (SELECT MAX", of_running, "> $3)) IS NULL THEN 0 ELSE 1 END"),
               {memory_bytes, absl::ToUnixMicros(now), absl::ToUnixMicros(now + kLongestLease)}));
  return has_lost == 1;
}

absl::StatusOr<std::optional<JobRow>> FindLostJob(Sql& sql, absl::Time now, int64_t memory_bytes) {
  LB_ASSIGN_OR_RETURN(const bool has_lost, HasLostJob(sql, now, memory_bytes));
  if (!has_lost) return std::optional<JobRow>();
  return FindFirstDue(sql, Running(sql), now, memory_bytes);
}

absl::StatusOr<std::optional<JobRow>> FindQueuedJob(Sql& sql, absl::Time now,
                                                    int64_t memory_bytes) {
  return FindFirstDue(sql, Queued(sql), now, memory_bytes);
}

// The time until the first job with `condition` becomes due; infinite if there is none. Only later
// times count: jobs that are due already are being leased by other workers.
absl::StatusOr<absl::Duration> TimeToDue(Sql& sql, const std::string& condition, absl::Time now,
                                         int64_t memory_bytes) {
  LB_ASSIGN_OR_RETURN(const int64_t due_us,
                      QueryInt(sql,
                               absl::StrCat("SELECT MIN(due_us) FROM jobs ", condition,
                                            " AND due_us > $1 AND memory_bytes <= $2"),
                               {absl::ToUnixMicros(now), memory_bytes}));
  return due_us == 0 ? absl::InfiniteDuration() : absl::FromUnixMicros(due_us) - now;
}

// Whether `a` is leased before `b`.
bool IsBefore(const JobRow& a, const JobRow& b) {
  return std::tuple(-a.record.priority(), a.record.turn(), a.number) <
         std::tuple(-b.record.priority(), b.record.turn(), b.number);
}

}  // namespace

absl::StatusOr<std::optional<JobRow>> FindJobToDo(Sql& sql, absl::Time now, int64_t memory_bytes) {
  LB_ASSIGN_OR_RETURN(std::optional<JobRow> lost, FindLostJob(sql, now, memory_bytes));
  LB_ASSIGN_OR_RETURN(std::optional<JobRow> queued, FindQueuedJob(sql, now, memory_bytes));
  if (!lost.has_value()) return queued;
  return queued.has_value() && IsBefore(*queued, *lost) ? queued : lost;
}

absl::StatusOr<absl::Duration> TimeToNextJob(Sql& sql, absl::Time now, int64_t memory_bytes) {
  LB_ASSIGN_OR_RETURN(const std::optional<JobRow> job, FindJobToDo(sql, now, memory_bytes));
  if (job.has_value()) return absl::ZeroDuration();
  LB_ASSIGN_OR_RETURN(const absl::Duration until_lost,
                      TimeToDue(sql, Running(sql), now, memory_bytes));
  LB_ASSIGN_OR_RETURN(const absl::Duration until_due,
                      TimeToDue(sql, QueuedByDue(sql), now, memory_bytes));
  return std::min(until_lost, until_due);
}

absl::StatusOr<int64_t> NextTurn(Sql& sql, const pb::JobRecord& job) {
  // Each query reads one end of an index.
  LB_ASSIGN_OR_RETURN(
      const int64_t given_out,
      QueryInt(sql, "SELECT MAX(turn) FROM jobs WHERE priority = $1 AND attempts > 0",
               {int64_t{job.priority()}}));
  LB_ASSIGN_OR_RETURN(
      const int64_t owners_last,
      QueryInt(sql,
               "SELECT MAX(turn) FROM jobs WHERE owner = $1 AND priority = $2 AND state IN "
               "(1, 2, 6)",
               {job.owner(), int64_t{job.priority()}}));
  // If the history was pruned, the smallest turn that waits stands in for the last one given out.
  LB_ASSIGN_OR_RETURN(
      const int64_t next,
      QueryInt(sql, "SELECT MIN(turn) FROM jobs WHERE priority = $1 AND state IN (1, 2)",
               {int64_t{job.priority()}}));
  return std::max({given_out, owners_last, next - 1}) + 1;
}

}  // namespace liquidblend::store
