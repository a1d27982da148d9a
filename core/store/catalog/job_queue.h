// The job queue of the catalog. Each function runs inside a transaction of its caller; its contract
// is in catalog.h. LeaseJob(), Heartbeat(), SaveCheckpoint() and ReleaseJob() change one row that
// they have locked, and may run beside other transactions (SqlBackend::ChangeJob); the other
// functions may not.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "core/store/catalog/catalog.h"
#include "core/store/catalog/outage_watch.h"
#include "core/store/sql/sql.h"

namespace liquidblend::store {

// Submit work, or check its owner: see Catalog.
absl::StatusOr<pb::JobRecord> SubmitImport(Sql& sql, const pb::AnimationRecord& animation,
                                           pb::JobRecord job, const OwnerCheck& check,
                                           absl::Time now);
absl::StatusOr<pb::JobRecord> SubmitRegistration(Sql& sql, pb::JobRecord job,
                                                 const OwnerCheck& check, absl::Time now);
absl::Status CheckOwner(Sql& sql, const pb::JobRecord& job, const OwnerCheck& check);

// Outcome of LeaseJob().
struct LeaseAttempt {
  // kEndDeadJobs: the next job must not start again; call EndDeadJobs(), then try again.
  enum Next { kNothing, kLease, kEndDeadJobs, kTryAgain };
  Next next = kNothing;
  std::optional<Lease> lease;
};
// What LeaseJob() and EndDeadJobs() have to know.
struct LeaseRequest {
  pb::WorkerRecord worker;
  absl::Duration duration;
  Outage outage;  // that the worker has met last
};
// Leases the next job, if that can be done by changing its row alone. See Catalog. A lease that
// ended during the outage, when its worker could not renew it, is renewed in its place, once.
absl::StatusOr<LeaseAttempt> LeaseJob(Sql& sql, const LeaseRequest& request,
                                      const RetryOptions& retry, absl::Time now);
// Ends the jobs at the head of the queue whose attempts are used up, or that were to be cancelled.
absl::Status EndDeadJobs(Sql& sql, const LeaseRequest& request, const RetryOptions& retry,
                         absl::Time now);
// Calls of the worker that holds the lease: see Catalog.
absl::StatusOr<JobControl> Heartbeat(Sql& sql, const std::string& lease_id, absl::Duration duration,
                                     const pb::JobProgress& progress, absl::Time now);
absl::Status SaveCheckpoint(Sql& sql, const std::string& lease_id, const std::string& blob,
                            absl::Time now);
absl::Status PublishAnimation(Sql& sql, const std::string& lease_id, pb::AnimationRecord animation,
                              absl::Time now);
absl::StatusOr<int64_t> PublishFamily(Sql& sql, const std::string& lease_id,
                                      pb::FamilyRecord family, absl::Time now);
absl::Status FinishChild(Sql& sql, const std::string& lease_id, const std::string& blob,
                         absl::Time now);
absl::Status RepeatChildren(Sql& sql, const std::string& lease_id,
                            const std::vector<std::string>& ids, const absl::Status& why,
                            absl::Time now);
absl::Status FailJob(Sql& sql, const std::string& lease_id, const absl::Status& error, bool retry,
                     const RetryOptions& options, absl::Time now);
// Gives the job back by changing its row alone. Returns false, and changes nothing, if it was to be
// cancelled; then CancelLeasedJob() ends it.
absl::StatusOr<bool> ReleaseJob(Sql& sql, const std::string& lease_id, absl::Time now);
absl::Status CancelLeasedJob(Sql& sql, const std::string& lease_id, absl::Time now);
// Cancels a job: see Catalog.
absl::Status RequestCancel(Sql& sql, const std::string& job_id, absl::Time now);

}  // namespace liquidblend::store
