// The tables of the SQLite catalog (docs/formats.md, "The catalog"), row by row.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/store/catalog.h"
#include "core/store/sqlite.h"

namespace liquidblend::store {

// Creates the tables, or brings those of an older version up to date.
// Errors: kFailedPrecondition if the database is something else, or newer than this program.
absl::Status PrepareTables(Database& db);

// A row of `jobs`.
struct JobRow {
  pb::JobRecord record;
  std::string lease_id;          // empty: nobody holds it
  int64_t lease_expires_us = 0;  // microseconds since 1970
};

// Errors of the Find functions: kNotFound, naming what is missing; kDataLoss for a record that
// cannot be read.
absl::StatusOr<pb::AnimationRecord> FindAnimation(Database& db, const std::string& id);
absl::StatusOr<pb::FamilyRecord> FindFamily(Database& db, const std::string& id);
absl::StatusOr<JobRow> FindJob(Database& db, const std::string& id);  // that is no part
absl::StatusOr<std::vector<pb::JobRecord>> FindParts(Database& db, const std::string& parent);
// kAborted if nobody holds that lease.
absl::StatusOr<JobRow> FindLeasedJob(Database& db, const std::string& lease_id);
// The oldest job or part that is queued, or whose lease has expired.
absl::StatusOr<std::optional<JobRow>> FindJobToDo(Database& db, int64_t now_us);
absl::StatusOr<std::optional<pb::JobRecord>> FindRequest(Database& db,
                                                         const std::string& request_id);
// Without parts.
absl::StatusOr<std::vector<pb::JobRecord>> FindUnfinishedJobs(Database& db);
// A family that has the animation as source or target; empty: none.
absl::StatusOr<std::string> FindFamilyWith(Database& db, const std::string& animation);

// Insert or replace.
absl::Status SaveAnimation(Database& db, const pb::AnimationRecord& animation);
absl::Status SaveFamily(Database& db, const pb::FamilyRecord& family);
absl::Status SetFamilyMembers(Database& db, const std::string& family,
                              const std::vector<std::string>& animations);
// The last version that was ever given to a family of that id, + 1; it counts as given now.
absl::StatusOr<int64_t> TakeFamilyVersion(Database& db, const std::string& family);

absl::Status InsertJob(Database& db, const pb::JobRecord& job);
// All but what never changes: id, subject, request id and parent.
absl::Status UpdateJob(Database& db, const JobRow& job);

absl::Status RemoveAnimation(Database& db, const std::string& id);
absl::Status RemoveFamily(Database& db, const std::string& id);
absl::Status RemoveJob(Database& db, const std::string& id);
absl::Status RemoveParts(Database& db, const std::string& parent);

// Up to `page_size` records after the page that `token` ends.
absl::StatusOr<Page<pb::AnimationRecord>> PageOfAnimations(Database& db, int page_size,
                                                           const std::string& token);
absl::StatusOr<Page<pb::FamilyRecord>> PageOfFamilies(Database& db, int page_size,
                                                      const std::string& token);
absl::StatusOr<Page<pb::JobRecord>> PageOfJobs(Database& db, int page_size,
                                               const std::string& token);

absl::StatusOr<std::vector<std::string>> BlobsInUse(Database& db);

}  // namespace liquidblend::store
