// The tables of the catalog (docs/formats.md, "The catalog"), row by row, in any database.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/store/catalog/catalog.h"
#include "core/store/sql/sql.h"

namespace liquidblend::store {

// A row of `jobs`.
struct JobRow {
  pb::JobRecord record;
  std::string lease_id;  // empty: not leased
  // Microseconds since 1970: while queued, when it may be leased; while running, when the lease
  // ends.
  int64_t due_us = 0;
  int64_t number = 0;  // grows with each job; 0: not known
};

// Reads the record of a job. Errors: kDataLoss, naming the database.
absl::StatusOr<pb::JobRecord> ParseJob(const Sql& sql, const std::string& bytes);

// Finds the first row of `jobs` that `where`, the rest of the statement, selects.
absl::StatusOr<std::optional<JobRow>> FindJobRow(Sql& sql, const std::string& where,
                                                 std::initializer_list<SqlValue> values);
// Find a record by its id; FindChildren(): those of a job, in the order of the targets.
// Errors: kNotFound, naming what is missing; kDataLoss for a record that cannot be read.
absl::StatusOr<pb::AnimationRecord> FindAnimation(Sql& sql, const std::string& id);
absl::StatusOr<pb::FamilyRecord> FindFamily(Sql& sql, const std::string& id);
absl::StatusOr<JobRow> FindJob(Sql& sql, const std::string& id);  // not a child
absl::StatusOr<std::vector<pb::JobRecord>> FindChildren(Sql& sql, const std::string& parent);
// Finds the job that is held by a lease. Errors: kAborted if the lease is not held any more.
absl::StatusOr<JobRow> FindLeasedJob(Sql& sql, const std::string& lease_id);
// Finds the job that was submitted with this request id, or nothing.
absl::StatusOr<std::optional<pb::JobRecord>> FindRequest(Sql& sql, const std::string& request_id);
// The id of a job, not a child, that makes this subject (SubjectOf()) and is not done; empty: none.
absl::StatusOr<std::string> FindUnfinishedJobOf(Sql& sql, const std::string& subject);
// The id of a registration, not a child, that needs the animation and is not done; empty: none.
// Cost: reads all registrations that are not done.
absl::StatusOr<std::string> FindUnfinishedRegistrationWith(Sql& sql, const std::string& animation);
// The number of jobs and children per state.
absl::StatusOr<JobCounts> CountJobsByState(Sql& sql);
// See Catalog::CountJobsByMemory().
absl::StatusOr<JobMemoryCounts> CountUnfinishedByMemory(Sql& sql);
// The id of a family that has the animation as source or target; empty: none.
absl::StatusOr<std::string> FindFamilyWith(Sql& sql, const std::string& animation);

// Insert a record, or replace the one of its id. SetFamilyMembers() replaces the list of a family's
// animations.
absl::Status SaveAnimation(Sql& sql, const pb::AnimationRecord& animation);
absl::Status SaveFamily(Sql& sql, const pb::FamilyRecord& family);
absl::Status SetFamilyMembers(Sql& sql, const std::string& family,
                              const std::vector<std::string>& animations);
// Allocates the next version number of a family's id: the last one ever given + 1.
absl::StatusOr<int64_t> TakeFamilyVersion(Sql& sql, const std::string& family);

// Inserts the row of a new job or child.
absl::Status InsertJob(Sql& sql, const pb::JobRecord& job);
// Updates a job's row, except for the constant columns: id, subject, request id, parent, owner,
// priority and turn.
absl::Status UpdateJob(Sql& sql, const JobRow& job);

// Remove rows, if there are any; RemoveFamily() those of kept versions, members and
// uses as well, RemoveChildren() all children of a job.
absl::Status RemoveAnimation(Sql& sql, const std::string& id);
absl::Status RemoveFamily(Sql& sql, const std::string& id);
absl::Status RemoveJob(Sql& sql, const std::string& id);
absl::Status RemoveChildren(Sql& sql, const std::string& parent);
// Count the jobs of the history that ended before `end`, or remove the oldest `max_num` of them and
// return their number.
absl::StatusOr<int64_t> CountHistory(Sql& sql, absl::Time end);
absl::StatusOr<int64_t> RemoveHistory(Sql& sql, absl::Time end, int64_t max_num);

// Return up to `page_size` records after the page that `token` ends.
absl::StatusOr<Page<pb::AnimationRecord>> PageOfAnimations(Sql& sql, int page_size,
                                                           const std::string& token);
absl::StatusOr<Page<pb::FamilyRecord>> PageOfFamilies(Sql& sql, int page_size,
                                                      const std::string& token);
absl::StatusOr<Page<pb::JobRecord>> PageOfJobs(Sql& sql, int page_size, const std::string& token);

}  // namespace liquidblend::store
