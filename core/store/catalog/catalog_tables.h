// The tables of the catalog (docs/formats.md, "The catalog"), row by row, in any database.
#pragma once

#include <cstdint>
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
  std::string lease_id;  // empty: nobody holds it
  // Microseconds since 1970: while queued, when it may be given out; while running, when the lease
  // ends.
  int64_t due_us = 0;
};

// Errors of the Find functions: kNotFound, naming what is missing; kDataLoss for a record that
// cannot be read.
absl::StatusOr<pb::AnimationRecord> FindAnimation(Sql& sql, const std::string& id);
absl::StatusOr<pb::FamilyRecord> FindFamily(Sql& sql, const std::string& id);
absl::StatusOr<JobRow> FindJob(Sql& sql, const std::string& id);  // that is no part
absl::StatusOr<std::vector<pb::JobRecord>> FindParts(Sql& sql, const std::string& parent);
// kAborted if nobody holds that lease.
absl::StatusOr<JobRow> FindLeasedJob(Sql& sql, const std::string& lease_id);
// Of the jobs and parts that are queued or running, and due, one of the highest priority, of these
// the one whose turn it is, of these the oldest. Due so late as none is counts as due: then the
// clock has been turned back. None needs more than memory_bytes.
absl::StatusOr<std::optional<JobRow>> FindJobToDo(Sql& sql, absl::Time now, int64_t memory_bytes);
// How long until there may be one: 0 if there is; infinite if none is queued or running.
absl::StatusOr<absl::Duration> TimeToNextJob(Sql& sql, absl::Time now, int64_t memory_bytes);
// The turn of a new job of that priority and owner: the next one after the owner's last that is not
// done, but not before the last turn that was given out, nor before whoever waits longest. So
// whoever asks for much waits for whoever asks for little (start-time fair queueing).
absl::StatusOr<int64_t> NextTurn(Sql& sql, const pb::JobRecord& job);
absl::StatusOr<std::optional<pb::JobRecord>> FindRequest(Sql& sql, const std::string& request_id);
// Without parts.
absl::StatusOr<std::vector<pb::JobRecord>> FindUnfinishedJobs(Sql& sql);
// How many jobs and parts are in which state.
absl::StatusOr<JobCounts> CountJobsByState(Sql& sql);
// A family that has the animation as source or target; empty: none.
absl::StatusOr<std::string> FindFamilyWith(Sql& sql, const std::string& animation);

// Insert or replace.
absl::Status SaveAnimation(Sql& sql, const pb::AnimationRecord& animation);
absl::Status SaveFamily(Sql& sql, const pb::FamilyRecord& family);
absl::Status SetFamilyMembers(Sql& sql, const std::string& family,
                              const std::vector<std::string>& animations);
// The last version that was ever given to a family of that id, + 1; it counts as given now.
absl::StatusOr<int64_t> TakeFamilyVersion(Sql& sql, const std::string& family);

absl::Status InsertJob(Sql& sql, const pb::JobRecord& job);
// All but what never changes: id, subject, request id, parent, owner, priority and turn.
absl::Status UpdateJob(Sql& sql, const JobRow& job);

absl::Status RemoveAnimation(Sql& sql, const std::string& id);
absl::Status RemoveFamily(Sql& sql, const std::string& id);
absl::Status RemoveJob(Sql& sql, const std::string& id);
absl::Status RemoveParts(Sql& sql, const std::string& parent);
// The jobs that ended before; the oldest ones first, and how many were removed.
absl::StatusOr<int64_t> CountHistory(Sql& sql, absl::Time end);
absl::StatusOr<int64_t> RemoveHistory(Sql& sql, absl::Time end, int64_t max_num);

// Up to `page_size` records after the page that `token` ends.
absl::StatusOr<Page<pb::AnimationRecord>> PageOfAnimations(Sql& sql, int page_size,
                                                           const std::string& token);
absl::StatusOr<Page<pb::FamilyRecord>> PageOfFamilies(Sql& sql, int page_size,
                                                      const std::string& token);
absl::StatusOr<Page<pb::JobRecord>> PageOfJobs(Sql& sql, int page_size, const std::string& token);

absl::StatusOr<std::vector<std::string>> BlobsInUse(Sql& sql);

}  // namespace liquidblend::store
