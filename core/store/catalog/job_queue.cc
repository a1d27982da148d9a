#include "core/store/catalog/job_queue.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/random_id.h"
#include "core/base/retry.h"
#include "core/base/status_macros.h"
#include "core/store/catalog/catalog_tables.h"
#include "core/store/catalog/job_records.h"
#include "core/store/catalog/next_job.h"
#include "core/store/catalog/owner_tables.h"
#include "core/store/catalog/version_tables.h"

namespace liquidblend::store {
namespace {

absl::Status CancelledStatus(const pb::JobRecord& job) {
  return absl::CancelledError(absl::StrCat("job '", job.id(), "' was cancelled"));
}

// Finds the job of an earlier call with this request id.
absl::StatusOr<std::optional<pb::JobRecord>> FindEarlier(Sql& sql, const pb::JobRecord& job) {
  if (job.request_id().empty()) return std::optional<pb::JobRecord>();
  LB_ASSIGN_OR_RETURN(std::optional<pb::JobRecord> earlier, FindRequest(sql, job.request_id()));
  if (!earlier.has_value() || SubjectOf(*earlier) == SubjectOf(job)) return earlier;
  return absl::InvalidArgumentError(absl::StrCat(
      "request_id '", job.request_id(), "' was used for ", SubjectOf(*earlier), " before"));
}

absl::Status AskAboutOwner(Sql& sql, const pb::JobRecord& job, const OwnerCheck& check) {
  if (!check) return absl::OkStatus();
  LB_ASSIGN_OR_RETURN(const OwnerUse use, FindOwnerUse(sql, job.owner()));
  return check(use);
}

absl::Status CheckReady(Sql& sql, const std::string& animation) {
  LB_ASSIGN_OR_RETURN(const pb::AnimationRecord record, FindAnimation(sql, animation));
  if (record.state() == pb::AnimationRecord::READY) return absl::OkStatus();
  return absl::FailedPreconditionError(
      absl::StrCat("animation '", animation, "' is not ready: its import ",
                   record.state() == pb::AnimationRecord::FAILED ? "failed" : "is not done"));
}

absl::Status CheckNobodyWorksOn(Sql& sql, const std::string& subject) {
  LB_ASSIGN_OR_RETURN(const std::string job, FindUnfinishedJobOf(sql, subject));
  if (job.empty()) return absl::OkStatus();
  return absl::FailedPreconditionError(absl::StrCat(
      "job '", job, "' of ", subject, " is not done: wait for it (liquidblend operations ", job,
      " --wait) or cancel it (liquidblend cancel ", job, ")"));
}

absl::Status NoteFailedRegistration(Sql& sql, const pb::JobRecord& job) {
  auto family = FindFamily(sql, job.register_family().family());
  if (absl::IsNotFound(family.status())) return absl::OkStatus();
  if (!family.ok()) return family.status();
  pb::FailedRegistration& failed = *family->mutable_failed_registration();
  failed.set_job(job.id());
  *failed.mutable_error() = job.error();
  *failed.mutable_end_time() = job.update_time();
  return SaveFamily(sql, *family);
}

// Writes the end of a job, and removes its children with their leases. A job that did not succeed
// also changes the record of its animation or family.
absl::Status Finish(Sql& sql, pb::JobRecord job) {
  LB_RETURN_IF_ERROR(UpdateJob(sql, {job, "", 0}));
  LB_RETURN_IF_ERROR(RemoveChildren(sql, job.id()));
  if (job.state() == pb::JobRecord::SUCCEEDED) return absl::OkStatus();
  if (job.has_register_family()) return NoteFailedRegistration(sql, job);
  auto animation = FindAnimation(sql, job.import_animation().animation());
  if (absl::IsNotFound(animation.status())) return absl::OkStatus();
  if (!animation.ok()) return animation.status();
  animation->set_state(pb::AnimationRecord::FAILED);
  *animation->mutable_error() = job.error();
  return SaveAnimation(sql, *animation);
}

// Ends a job with an error; the error of a child ends its parent.
absl::Status FinishWithError(Sql& sql, pb::JobRecord job, absl::Status error, absl::Time now) {
  if (!job.parent().empty()) {
    LB_ASSIGN_OR_RETURN(JobRow parent, FindJob(sql, job.parent()));
    error = ErrorOfChild(error, job, parent.record);
    TakeFailures(job, parent.record);
    job = std::move(parent.record);
  }
  Fail(error, now, job);
  return Finish(sql, std::move(job));
}

// Inserts a child for each target of the registration.
absl::Status InsertChildren(Sql& sql, const pb::JobRecord& job, absl::Time now) {
  for (int k = 0; k < job.register_family().targets_size(); ++k) {
    LB_RETURN_IF_ERROR(InsertJob(sql, NewChild(job, k, now)));
  }
  return absl::OkStatus();
}

// The worker of a job that is RUNNING, although it is to do, was lost: records that as a failure.
// It counts as an attempt only if that has left no checkpoint: a farm may end workers by SIGKILL
// again and again, whereas a job that harms its workers does so at the same place.
void NoteLossOfWorker(absl::Time now, pb::JobRecord& job) {
  if (job.state() != pb::JobRecord::RUNNING) return;
  const bool has_progressed = HasNewCheckpoint(job);
  NoteFailure(absl::InternalError("the worker was lost"), /*lost=*/true, now, job);
  if (has_progressed) CountLossAfterProgress(job);
}

// Whether the worker of this job, which is to do, could not renew its lease because of the outage.
// Shortly after it, workers are still connecting again.
bool HasLapsedIn(const LeaseRequest& request, const JobRow& row) {
  const absl::Time lapsed = absl::FromUnixMicros(row.due_us);
  return row.record.state() == pb::JobRecord::RUNNING && lapsed >= request.outage.begin &&
         lapsed < request.outage.end + request.duration / 3;
}

// Checks that the job or child may have one more attempt. The error ends it otherwise.
absl::Status MayStart(const pb::JobRecord& job, const RetryOptions& retry) {
  if (job.cancel_requested()) return CancelledStatus(job);
  if (job.attempts() < retry.max_attempts) return absl::OkStatus();
  return absl::InternalError(absl::StrCat("job '", job.id(), "' was given up after ",
                                          job.attempts(), " attempts: its worker was lost ",
                                          NumLosses(job), " times, last on ", job.worker()));
}

// Returns the job to the queue, to be leased at `due` or later.
absl::Status PutOff(Sql& sql, absl::Time due, absl::Time now, pb::JobRecord job) {
  ReturnToQueue(now, job);
  *job.mutable_next_attempt_time() = ToTimestamp(due);
  return UpdateJob(sql, {std::move(job), "", absl::ToUnixMicros(due)});
}

// The time at which the job may start: at once, or after a pause if it has lost its worker more
// than once.
absl::Time StartOf(const JobRow& row, const RetryOptions& retry) {
  const absl::Time due = absl::FromUnixMicros(row.due_us);
  const bool is_lost = row.record.state() == pb::JobRecord::RUNNING;
  if (!is_lost || NumLosses(row.record) < 2) return due;
  return due + PauseAfter(std::max(1, row.record.attempts()), retry);
}

pb::Grade WorstGrade(const pb::FamilyManifest& manifest) {
  pb::Grade worst = pb::GRADE_UNSPECIFIED;
  for (const pb::RegistrationReport& report : manifest.reports()) {
    worst = std::max(worst, report.verdict().grade());
  }
  return worst;
}

int64_t LeaseEnd(absl::Time now, absl::Duration duration) {
  return absl::ToUnixMicros(now + std::min(duration, kLongestLease));
}

}  // namespace

absl::StatusOr<pb::JobRecord> SubmitImport(Sql& sql, const pb::AnimationRecord& animation,
                                           pb::JobRecord job, const OwnerCheck& check,
                                           absl::Time now) {
  LB_RETURN_IF_ERROR(CheckImport(animation, job));
  LB_ASSIGN_OR_RETURN(std::optional<pb::JobRecord> earlier, FindEarlier(sql, job));
  if (earlier.has_value()) return *std::move(earlier);
  const auto existing = FindAnimation(sql, animation.id());
  if (existing.ok() && existing->state() != pb::AnimationRecord::FAILED) {
    return absl::AlreadyExistsError(
        absl::StrCat("animation '", animation.id(),
                     "' exists already; choose another name, or delete it first"));
  }
  if (!existing.ok() && !absl::IsNotFound(existing.status())) return existing.status();
  LB_RETURN_IF_ERROR(AskAboutOwner(sql, job, check));
  job = NewJob(std::move(job), now);
  LB_ASSIGN_OR_RETURN(const int64_t turn, NextTurn(sql, job));
  job.set_turn(turn);
  LB_RETURN_IF_ERROR(SaveAnimation(sql, NewAnimation(animation, job, now)));
  LB_RETURN_IF_ERROR(InsertJob(sql, job));
  return job;
}

absl::StatusOr<pb::JobRecord> SubmitRegistration(Sql& sql, pb::JobRecord job,
                                                 const OwnerCheck& check, absl::Time now) {
  LB_RETURN_IF_ERROR(CheckRegistration(job));
  LB_ASSIGN_OR_RETURN(std::optional<pb::JobRecord> earlier, FindEarlier(sql, job));
  if (earlier.has_value()) return *std::move(earlier);
  const std::string& family = job.register_family().family();
  auto existing = FindFamily(sql, family);
  if (!existing.ok() && !absl::IsNotFound(existing.status())) return existing.status();
  if (job.register_family().must_be_new() && existing.ok() && existing->version() > 0) {
    return absl::AlreadyExistsError(
        absl::StrCat("family '", family, "' exists already, in version ", existing->version()));
  }
  for (const std::string& animation : AnimationsOf(job)) {
    LB_RETURN_IF_ERROR(CheckReady(sql, animation));
  }
  LB_RETURN_IF_ERROR(CheckNobodyWorksOn(sql, SubjectOf(job)));
  LB_RETURN_IF_ERROR(AskAboutOwner(sql, job, check));
  if (!existing.ok()) {
    pb::FamilyRecord record;
    record.set_id(family);
    *record.mutable_create_time() = *record.mutable_update_time() = ToTimestamp(now);
    LB_RETURN_IF_ERROR(SaveFamily(sql, record));
  } else if (existing->has_failed_registration()) {
    existing->clear_failed_registration();
    LB_RETURN_IF_ERROR(SaveFamily(sql, *existing));
  }
  job = NewJob(std::move(job), now);
  LB_ASSIGN_OR_RETURN(const int64_t turn, NextTurn(sql, job));
  job.set_turn(turn);
  LB_RETURN_IF_ERROR(InsertJob(sql, job));
  if (job.state() == pb::JobRecord::WAITING) LB_RETURN_IF_ERROR(InsertChildren(sql, job, now));
  return job;
}

absl::Status CheckOwner(Sql& sql, const pb::JobRecord& job, const OwnerCheck& check) {
  LB_ASSIGN_OR_RETURN(const std::optional<pb::JobRecord> earlier, FindEarlier(sql, job));
  return earlier.has_value() ? absl::OkStatus() : AskAboutOwner(sql, job, check);
}

absl::StatusOr<LeaseAttempt> LeaseJob(Sql& sql, const LeaseRequest& request,
                                      const RetryOptions& retry, absl::Time now) {
  LB_ASSIGN_OR_RETURN(std::optional<JobRow> row,
                      FindJobToDo(sql, now, request.worker.memory_bytes()));
  if (!row.has_value()) return LeaseAttempt{.next = LeaseAttempt::kNothing, .lease = {}};
  if (HasLapsedIn(request, *row)) {
    row->due_us = LeaseEnd(now, request.duration);
    LB_RETURN_IF_ERROR(UpdateJob(sql, *row));
    return LeaseAttempt{.next = LeaseAttempt::kTryAgain, .lease = {}};
  }
  NoteLossOfWorker(now, row->record);
  if (!MayStart(row->record, retry).ok()) {
    return LeaseAttempt{.next = LeaseAttempt::kEndDeadJobs, .lease = {}};
  }
  const absl::Time start = StartOf(*row, retry);
  if (start > now && start <= now + kLongestLease) {
    LB_RETURN_IF_ERROR(PutOff(sql, start, now, std::move(row->record)));
    return LeaseAttempt{.next = LeaseAttempt::kTryAgain, .lease = {}};
  }
  StartAttempt(request.worker.name(), now, row->record);
  row->lease_id = base::RandomHex(16);
  row->due_us = LeaseEnd(now, request.duration);
  LB_RETURN_IF_ERROR(UpdateJob(sql, *row));
  return LeaseAttempt{.next = LeaseAttempt::kLease,
                      .lease = Lease{row->lease_id, std::move(row->record)}};
}

absl::Status EndDeadJobs(Sql& sql, const LeaseRequest& request, const RetryOptions& retry,
                         absl::Time now) {
  while (true) {
    LB_ASSIGN_OR_RETURN(std::optional<JobRow> row,
                        FindJobToDo(sql, now, request.worker.memory_bytes()));
    if (!row.has_value() || HasLapsedIn(request, *row)) return absl::OkStatus();
    NoteLossOfWorker(now, row->record);
    const absl::Status end = MayStart(row->record, retry);
    if (end.ok()) return absl::OkStatus();
    LB_RETURN_IF_ERROR(FinishWithError(sql, std::move(row->record), end, now));
  }
}

absl::StatusOr<JobControl> Heartbeat(Sql& sql, const std::string& lease_id, absl::Duration duration,
                                     const pb::JobProgress& progress, absl::Time now) {
  LB_ASSIGN_OR_RETURN(JobRow row, FindLeasedJob(sql, lease_id));
  *row.record.mutable_progress() = progress;
  *row.record.mutable_update_time() = ToTimestamp(now);
  row.due_us = LeaseEnd(now, duration);
  LB_RETURN_IF_ERROR(UpdateJob(sql, row));
  return JobControl{row.record.cancel_requested()};
}

absl::Status SaveCheckpoint(Sql& sql, const std::string& lease_id, const std::string& blob,
                            absl::Time now) {
  LB_ASSIGN_OR_RETURN(JobRow row, FindLeasedJob(sql, lease_id));
  row.record.set_checkpoint_blob(blob);
  *row.record.mutable_checkpoint_time() = ToTimestamp(now);
  *row.record.mutable_update_time() = ToTimestamp(now);
  return UpdateJob(sql, row);
}

absl::Status PublishAnimation(Sql& sql, const std::string& lease_id, pb::AnimationRecord animation,
                              absl::Time now) {
  LB_ASSIGN_OR_RETURN(JobRow row, FindLeasedJob(sql, lease_id));
  LB_RETURN_IF_ERROR(CheckImport(animation, row.record));
  LB_ASSIGN_OR_RETURN(const pb::AnimationRecord existing, FindAnimation(sql, animation.id()));
  animation.set_state(pb::AnimationRecord::READY);
  animation.clear_error();
  animation.set_owner(row.record.owner());
  animation.set_upload_bytes(existing.upload_bytes());
  *animation.mutable_create_time() = existing.create_time();
  LB_RETURN_IF_ERROR(SaveAnimation(sql, animation));
  Succeed(now, row.record);
  return Finish(sql, std::move(row.record));
}

absl::StatusOr<int64_t> PublishFamily(Sql& sql, const std::string& lease_id,
                                      pb::FamilyRecord family, absl::Time now) {
  LB_ASSIGN_OR_RETURN(JobRow row, FindLeasedJob(sql, lease_id));
  if (row.record.register_family().family() != family.id() || family.id().empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat("job '", row.record.id(), "' does not register family '", family.id(), "'"));
  }
  LB_ASSIGN_OR_RETURN(const pb::FamilyRecord existing, FindFamily(sql, family.id()));
  family.set_owner(row.record.owner());
  LB_ASSIGN_OR_RETURN(family,
                      PublishVersion(sql, existing, std::move(family), AnimationsOf(row.record),
                                     row.record.register_family().keep_versions(), now));
  const int64_t version = family.version();
  row.record.set_published_version(version);
  row.record.set_grade(WorstGrade(family.manifest()));
  Succeed(now, row.record);
  LB_RETURN_IF_ERROR(Finish(sql, std::move(row.record)));
  return version;
}

// If this is the last child to end, its parent is queued.
absl::Status FinishChild(Sql& sql, const std::string& lease_id, const std::string& blob,
                         absl::Time now) {
  LB_ASSIGN_OR_RETURN(JobRow row, FindLeasedJob(sql, lease_id));
  if (row.record.parent().empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat("job '", row.record.id(), "' is not a child of another"));
  }
  LB_ASSIGN_OR_RETURN(JobRow parent, FindJob(sql, row.record.parent()));
  const bool is_first = !parent.record.has_first_start_time();
  if (is_first) *parent.record.mutable_first_start_time() = row.record.start_time();
  row.record.set_result_blob(blob);
  Succeed(now, row.record);
  LB_RETURN_IF_ERROR(UpdateJob(sql, {std::move(row.record), "", 0}));
  LB_ASSIGN_OR_RETURN(const std::vector<pb::JobRecord> children,
                      FindChildren(sql, parent.record.id()));
  if (std::any_of(children.begin(), children.end(), IsUnfinished)) {
    return is_first ? UpdateJob(sql, parent) : absl::OkStatus();
  }
  ReturnToQueue(now, parent.record);
  return UpdateJob(sql, {std::move(parent.record), "", 0});
}

absl::Status RepeatChildren(Sql& sql, const std::string& lease_id,
                            const std::vector<std::string>& ids, const absl::Status& why,
                            absl::Time now) {
  LB_ASSIGN_OR_RETURN(JobRow parent, FindLeasedJob(sql, lease_id));
  if (parent.record.cancel_requested()) {
    return FinishWithError(sql, parent.record, CancelledStatus(parent.record), now);
  }
  LB_ASSIGN_OR_RETURN(std::vector<pb::JobRecord> children, FindChildren(sql, parent.record.id()));
  for (const std::string& id : ids) {
    const auto child = std::find_if(children.begin(), children.end(), [&](const auto& each) {
      return each.id() == id && each.state() == pb::JobRecord::SUCCEEDED;
    });
    if (child == children.end()) {
      return absl::InvalidArgumentError(absl::StrCat(
          "job '", parent.record.id(), "' has no child '", id, "' that has succeeded"));
    }
    Repeat(why, now, *child, parent.record);
    LB_RETURN_IF_ERROR(UpdateJob(sql, {std::move(*child), "", 0}));
  }
  WaitAgain(now, parent.record);
  return UpdateJob(sql, {std::move(parent.record), "", 0});
}

absl::Status FailJob(Sql& sql, const std::string& lease_id, const absl::Status& error, bool retry,
                     const RetryOptions& options, absl::Time now) {
  if (error.ok()) return absl::InvalidArgumentError("FailJob needs an error");
  LB_ASSIGN_OR_RETURN(JobRow row, FindLeasedJob(sql, lease_id));
  if (row.record.cancel_requested()) {
    return FinishWithError(sql, row.record, CancelledStatus(row.record), now);
  }
  NoteFailure(error, /*lost=*/false, now, row.record);
  if (!retry) return FinishWithError(sql, std::move(row.record), error, now);
  const bool is_counted = !base::IsTransient(error);
  if (!is_counted) CountForEnvironment(row.record);
  const int num_failures = is_counted ? row.record.attempts() : row.record.environment_failures();
  if (num_failures >= (is_counted ? options.max_attempts : options.max_environment_failures)) {
    return FinishWithError(sql, std::move(row.record), error, now);
  }
  return PutOff(sql, now + PauseAfter(num_failures, options), now, std::move(row.record));
}

absl::StatusOr<bool> ReleaseJob(Sql& sql, const std::string& lease_id, absl::Time now) {
  LB_ASSIGN_OR_RETURN(JobRow row, FindLeasedJob(sql, lease_id));
  if (row.record.cancel_requested()) return false;
  HandBack(now, row.record);
  LB_RETURN_IF_ERROR(UpdateJob(sql, {std::move(row.record), "", 0}));
  return true;
}

absl::Status CancelLeasedJob(Sql& sql, const std::string& lease_id, absl::Time now) {
  LB_ASSIGN_OR_RETURN(JobRow row, FindLeasedJob(sql, lease_id));
  return FinishWithError(sql, row.record, CancelledStatus(row.record), now);
}

absl::Status RequestCancel(Sql& sql, const std::string& job_id, absl::Time now) {
  LB_ASSIGN_OR_RETURN(JobRow row, FindJob(sql, job_id));
  if (!IsUnfinished(row.record)) return absl::OkStatus();
  row.record.set_cancel_requested(true);
  *row.record.mutable_update_time() = ToTimestamp(now);
  const bool is_held =
      row.record.state() == pb::JobRecord::RUNNING && row.due_us > absl::ToUnixMicros(now);
  if (is_held) return UpdateJob(sql, row);
  return FinishWithError(sql, row.record, CancelledStatus(row.record), now);
}

}  // namespace liquidblend::store
