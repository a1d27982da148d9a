#include "core/store/sqlite_queue.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/store/job_records.h"
#include "core/store/random_id.h"
#include "core/store/sqlite_tables.h"

namespace liquidblend::store {
namespace {

absl::Status CancelledStatus(const pb::JobRecord& job) {
  return absl::CancelledError(absl::StrCat("job '", job.id(), "' was cancelled"));
}

// The job of an earlier call with this request id.
absl::StatusOr<std::optional<pb::JobRecord>> FindEarlier(Database& db, const pb::JobRecord& job) {
  if (job.request_id().empty()) return std::optional<pb::JobRecord>();
  LB_ASSIGN_OR_RETURN(std::optional<pb::JobRecord> earlier, FindRequest(db, job.request_id()));
  if (!earlier.has_value() || SubjectOf(*earlier) == SubjectOf(job)) return earlier;
  return absl::InvalidArgumentError(absl::StrCat(
      "request_id '", job.request_id(), "' was used for ", SubjectOf(*earlier), " before"));
}

absl::Status CheckReady(Database& db, const std::string& animation) {
  LB_ASSIGN_OR_RETURN(const pb::AnimationRecord record, FindAnimation(db, animation));
  if (record.state() == pb::AnimationRecord::READY) return absl::OkStatus();
  return absl::FailedPreconditionError(
      absl::StrCat("animation '", animation, "' is not ready: its import ",
                   record.state() == pb::AnimationRecord::FAILED ? "failed" : "is not done"));
}

absl::Status CheckNobodyWorksOn(Database& db, const std::string& subject) {
  LB_ASSIGN_OR_RETURN(const std::vector<pb::JobRecord> jobs, FindUnfinishedJobs(db));
  for (const pb::JobRecord& job : jobs) {
    if (SubjectOf(job) != subject) continue;
    return absl::FailedPreconditionError(
        absl::StrCat("job '", job.id(), "' of ", subject, " is not done"));
  }
  return absl::OkStatus();
}

// Writes the job's end, and that of its parts: they go, and with them the leases of those who work
// on them. An import that did not succeed is told to its animation too.
absl::Status Finish(Database& db, pb::JobRecord job) {
  LB_RETURN_IF_ERROR(UpdateJob(db, {job, "", 0}));
  LB_RETURN_IF_ERROR(RemoveParts(db, job.id()));
  if (!job.has_import_animation() || job.state() == pb::JobRecord::SUCCEEDED) {
    return absl::OkStatus();
  }
  auto animation = FindAnimation(db, job.import_animation().animation());
  if (absl::IsNotFound(animation.status())) return absl::OkStatus();
  if (!animation.ok()) return animation.status();
  animation->set_state(pb::AnimationRecord::FAILED);
  *animation->mutable_error() = job.error();
  return SaveAnimation(db, *animation);
}

// What ends a part ends the job that it is a part of.
absl::Status FinishWithError(Database& db, pb::JobRecord job, absl::Status error, absl::Time now) {
  if (!job.parent().empty()) {
    LB_ASSIGN_OR_RETURN(JobRow parent, FindJob(db, job.parent()));
    error = ErrorOfPart(error, job, parent.record);
    job = std::move(parent.record);
  }
  Fail(error, now, job);
  return Finish(db, std::move(job));
}

// A registration of several targets waits for as many parts.
absl::Status InsertParts(Database& db, const pb::JobRecord& job, absl::Time now) {
  for (int k = 0; k < job.register_family().targets_size(); ++k) {
    LB_RETURN_IF_ERROR(InsertJob(db, NewPart(job, k, now)));
  }
  return absl::OkStatus();
}

// The error that ends a job or part of one more attempt; OK if it may have that.
absl::Status MayStart(const pb::JobRecord& job, int max_attempts) {
  if (job.cancel_requested()) return CancelledStatus(job);
  if (job.attempts() < max_attempts) return absl::OkStatus();
  return absl::InternalError(absl::StrCat("job '", job.id(), "' was given up: its worker was lost ",
                                          job.attempts(), " times, last on ", job.worker()));
}

}  // namespace

absl::StatusOr<pb::JobRecord> SubmitImport(Database& db, const pb::AnimationRecord& animation,
                                           pb::JobRecord job, absl::Time now) {
  LB_RETURN_IF_ERROR(CheckImport(animation, job));
  LB_ASSIGN_OR_RETURN(std::optional<pb::JobRecord> earlier, FindEarlier(db, job));
  if (earlier.has_value()) return *std::move(earlier);
  const auto existing = FindAnimation(db, animation.id());
  if (existing.ok() && existing->state() != pb::AnimationRecord::FAILED) {
    return absl::AlreadyExistsError(
        absl::StrCat("animation '", animation.id(), "' exists already"));
  }
  if (!existing.ok() && !absl::IsNotFound(existing.status())) return existing.status();
  job = NewJob(std::move(job), now);
  LB_RETURN_IF_ERROR(SaveAnimation(db, NewAnimation(animation, now)));
  LB_RETURN_IF_ERROR(InsertJob(db, job));
  return job;
}

absl::StatusOr<pb::JobRecord> SubmitRegistration(Database& db, pb::JobRecord job, absl::Time now) {
  LB_RETURN_IF_ERROR(CheckRegistration(job));
  LB_ASSIGN_OR_RETURN(std::optional<pb::JobRecord> earlier, FindEarlier(db, job));
  if (earlier.has_value()) return *std::move(earlier);
  for (const std::string& animation : AnimationsOf(job)) {
    LB_RETURN_IF_ERROR(CheckReady(db, animation));
  }
  LB_RETURN_IF_ERROR(CheckNobodyWorksOn(db, SubjectOf(job)));
  const std::string& family = job.register_family().family();
  const auto existing = FindFamily(db, family);
  if (absl::IsNotFound(existing.status())) {
    pb::FamilyRecord record;
    record.set_id(family);
    *record.mutable_create_time() = *record.mutable_update_time() = ToTimestamp(now);
    LB_RETURN_IF_ERROR(SaveFamily(db, record));
  } else if (!existing.ok()) {
    return existing.status();
  }
  job = NewJob(std::move(job), now);
  LB_RETURN_IF_ERROR(InsertJob(db, job));
  if (job.state() == pb::JobRecord::WAITING) LB_RETURN_IF_ERROR(InsertParts(db, job, now));
  return job;
}

absl::StatusOr<std::optional<Lease>> LeaseJob(Database& db, const std::string& worker,
                                              absl::Duration duration, int max_attempts,
                                              absl::Time now) {
  while (true) {
    LB_ASSIGN_OR_RETURN(std::optional<JobRow> row, FindJobToDo(db, absl::ToUnixMicros(now)));
    if (!row.has_value()) return std::optional<Lease>();
    if (const absl::Status end = MayStart(row->record, max_attempts); !end.ok()) {
      LB_RETURN_IF_ERROR(FinishWithError(db, std::move(row->record), end, now));
      continue;
    }
    StartAttempt(worker, now, row->record);
    row->lease_id = RandomHex(16);
    row->lease_expires_us = absl::ToUnixMicros(now + duration);
    LB_RETURN_IF_ERROR(UpdateJob(db, *row));
    return Lease{row->lease_id, std::move(row->record)};
  }
}

absl::StatusOr<JobControl> Heartbeat(Database& db, const std::string& lease_id,
                                     absl::Duration duration, const pb::JobProgress& progress,
                                     absl::Time now) {
  LB_ASSIGN_OR_RETURN(JobRow row, FindLeasedJob(db, lease_id));
  *row.record.mutable_progress() = progress;
  *row.record.mutable_update_time() = ToTimestamp(now);
  row.lease_expires_us = absl::ToUnixMicros(now + duration);
  LB_RETURN_IF_ERROR(UpdateJob(db, row));
  return JobControl{row.record.cancel_requested()};
}

absl::Status PublishAnimation(Database& db, const std::string& lease_id,
                              pb::AnimationRecord animation, absl::Time now) {
  LB_ASSIGN_OR_RETURN(JobRow row, FindLeasedJob(db, lease_id));
  LB_RETURN_IF_ERROR(CheckImport(animation, row.record));
  LB_ASSIGN_OR_RETURN(const pb::AnimationRecord existing, FindAnimation(db, animation.id()));
  animation.set_state(pb::AnimationRecord::READY);
  animation.clear_error();
  *animation.mutable_create_time() = existing.create_time();
  LB_RETURN_IF_ERROR(SaveAnimation(db, animation));
  Succeed(now, row.record);
  return Finish(db, std::move(row.record));
}

absl::StatusOr<int64_t> PublishFamily(Database& db, const std::string& lease_id,
                                      pb::FamilyRecord family, absl::Time now) {
  LB_ASSIGN_OR_RETURN(JobRow row, FindLeasedJob(db, lease_id));
  if (row.record.register_family().family() != family.id() || family.id().empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat("job '", row.record.id(), "' does not register family '", family.id(), "'"));
  }
  LB_ASSIGN_OR_RETURN(const pb::FamilyRecord existing, FindFamily(db, family.id()));
  LB_ASSIGN_OR_RETURN(const int64_t version, TakeFamilyVersion(db, family.id()));
  family.set_version(version);
  family.mutable_manifest()->set_version(version);
  *family.mutable_create_time() = existing.create_time();
  *family.mutable_update_time() = ToTimestamp(now);
  LB_RETURN_IF_ERROR(SaveFamily(db, family));
  LB_RETURN_IF_ERROR(SetFamilyMembers(db, family.id(), AnimationsOf(row.record)));
  Succeed(now, row.record);
  LB_RETURN_IF_ERROR(Finish(db, std::move(row.record)));
  return version;
}

// The end of the last part queues the parent. A backend where two parts may end in two transactions
// at once has to lock the parent first.
absl::Status FinishPart(Database& db, const std::string& lease_id, const std::string& blob,
                        absl::Time now) {
  LB_ASSIGN_OR_RETURN(JobRow row, FindLeasedJob(db, lease_id));
  if (row.record.parent().empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat("job '", row.record.id(), "' is no part of another"));
  }
  LB_ASSIGN_OR_RETURN(JobRow parent, FindJob(db, row.record.parent()));
  row.record.set_result_blob(blob);
  Succeed(now, row.record);
  LB_RETURN_IF_ERROR(UpdateJob(db, {std::move(row.record), "", 0}));
  LB_ASSIGN_OR_RETURN(const std::vector<pb::JobRecord> parts, FindParts(db, parent.record.id()));
  if (std::any_of(parts.begin(), parts.end(), IsUnfinished)) return absl::OkStatus();
  ReturnToQueue(now, parent.record);
  return UpdateJob(db, parent);
}

absl::Status FailJob(Database& db, const std::string& lease_id, const absl::Status& error,
                     bool retry, int max_attempts, absl::Time now) {
  if (error.ok()) return absl::InvalidArgumentError("FailJob needs an error");
  LB_ASSIGN_OR_RETURN(JobRow row, FindLeasedJob(db, lease_id));
  if (row.record.cancel_requested()) {
    return FinishWithError(db, row.record, CancelledStatus(row.record), now);
  }
  if (!retry || row.record.attempts() >= max_attempts) {
    return FinishWithError(db, std::move(row.record), error, now);
  }
  ReturnToQueue(now, row.record);
  return UpdateJob(db, {std::move(row.record), "", 0});
}

absl::Status ReleaseJob(Database& db, const std::string& lease_id, absl::Time now) {
  LB_ASSIGN_OR_RETURN(JobRow row, FindLeasedJob(db, lease_id));
  if (row.record.cancel_requested()) {
    return FinishWithError(db, row.record, CancelledStatus(row.record), now);
  }
  row.record.set_attempts(row.record.attempts() - 1);
  ReturnToQueue(now, row.record);
  return UpdateJob(db, {std::move(row.record), "", 0});
}

absl::Status RequestCancel(Database& db, const std::string& job_id, absl::Time now) {
  LB_ASSIGN_OR_RETURN(JobRow row, FindJob(db, job_id));
  if (!IsUnfinished(row.record)) return absl::OkStatus();
  row.record.set_cancel_requested(true);
  *row.record.mutable_update_time() = ToTimestamp(now);
  const bool is_held = row.record.state() == pb::JobRecord::RUNNING &&
                       row.lease_expires_us > absl::ToUnixMicros(now);
  if (is_held) return UpdateJob(db, row);
  return FinishWithError(db, row.record, CancelledStatus(row.record), now);
}

}  // namespace liquidblend::store
