// The job queue of the SQLite catalog. Each function runs inside a transaction of its caller; what
// it promises stands in catalog.h.
#pragma once

#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "core/store/catalog.h"
#include "core/store/sqlite.h"

namespace liquidblend::store {

absl::StatusOr<pb::JobRecord> SubmitImport(Database& db, const pb::AnimationRecord& animation,
                                           pb::JobRecord job, absl::Time now);
absl::StatusOr<pb::JobRecord> SubmitRegistration(Database& db, pb::JobRecord job, absl::Time now);

// On the way, jobs whose attempts are used up, or that were to be cancelled, come to their end.
absl::StatusOr<std::optional<Lease>> LeaseJob(Database& db, const std::string& worker,
                                              absl::Duration duration, int max_attempts,
                                              absl::Time now);
absl::StatusOr<JobControl> Heartbeat(Database& db, const std::string& lease_id,
                                     absl::Duration duration, const pb::JobProgress& progress,
                                     absl::Time now);
absl::Status PublishAnimation(Database& db, const std::string& lease_id,
                              pb::AnimationRecord animation, absl::Time now);
absl::StatusOr<int64_t> PublishFamily(Database& db, const std::string& lease_id,
                                      pb::FamilyRecord family, absl::Time now);
absl::Status FinishPart(Database& db, const std::string& lease_id, const std::string& blob,
                        absl::Time now);
absl::Status FailJob(Database& db, const std::string& lease_id, const absl::Status& error,
                     bool retry, int max_attempts, absl::Time now);
absl::Status ReleaseJob(Database& db, const std::string& lease_id, absl::Time now);
absl::Status RequestCancel(Database& db, const std::string& job_id, absl::Time now);

}  // namespace liquidblend::store
