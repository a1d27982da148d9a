#include "core/store/catalog/job_records.h"

#include <algorithm>

#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "core/base/random_id.h"
#include "google/protobuf/util/time_util.h"

namespace liquidblend::store {
namespace {

using google::protobuf::util::TimeUtil;

constexpr int kDefaultPageSize = 100;
constexpr int kMaxPageSize = 1000;

const std::string& TargetOf(const pb::JobRecord& child, const pb::JobRecord& parent) {
  return parent.register_family().targets(child.register_target().target_index());
}

void AddFailure(const pb::FailedAttempt& attempt, pb::JobRecord& job) {
  *job.add_failed_attempts() = attempt;
  const int num_old = job.failed_attempts_size() - kKeptAttempts;
  if (num_old > 0) job.mutable_failed_attempts()->DeleteSubrange(0, num_old);
}

// Whether two records are of one attempt of a child, whose parent's record names the target.
bool IsSameAttempt(const pb::FailedAttempt& a, const pb::FailedAttempt& b) {
  return a.worker() == b.worker() && a.end_time().seconds() == b.end_time().seconds() &&
         a.end_time().nanos() == b.end_time().nanos();
}

void AddFailureOfChild(pb::FailedAttempt attempt, const pb::JobRecord& child,
                       pb::JobRecord& parent) {
  attempt.mutable_error()->set_message(
      absl::StrCat("target '", TargetOf(child, parent), "': ", attempt.error().message()));
  AddFailure(attempt, parent);
}

}  // namespace

bool IsUnfinished(const pb::JobRecord& job) {
  return job.state() == pb::JobRecord::QUEUED || job.state() == pb::JobRecord::RUNNING ||
         job.state() == pb::JobRecord::WAITING;
}

std::string SubjectOf(const pb::JobRecord& job) {
  if (job.has_import_animation()) {
    return absl::StrCat("animations/", job.import_animation().animation());
  }
  return absl::StrCat("families/", job.has_register_target() ? job.register_target().family()
                                                             : job.register_family().family());
}

std::vector<std::string> AnimationsOf(const pb::JobRecord& job) {
  if (job.has_import_animation()) return {job.import_animation().animation()};
  if (job.has_register_target()) return {};
  const pb::RegisterJob& registration = job.register_family();
  std::vector<std::string> ids = {registration.source()};
  ids.insert(ids.end(), registration.targets().begin(), registration.targets().end());
  return ids;
}

// Assigns empty lists: a list that is cleared keeps its memory.
void DropLists(pb::JobRecord& job) {
  if (job.has_import_animation()) {
    *job.mutable_import_animation()->mutable_files() = {};
    *job.mutable_import_animation()->mutable_options()->mutable_frame_times() = {};
  }
  if (job.has_register_family()) *job.mutable_register_family()->mutable_correspondences() = {};
}

absl::Status CheckImport(const pb::AnimationRecord& animation, const pb::JobRecord& job) {
  if (animation.id().empty()) return absl::InvalidArgumentError("an animation needs an id");
  if (job.has_import_animation() && job.import_animation().animation() == animation.id()) {
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError(
      absl::StrCat("the job does not import animation '", animation.id(), "'"));
}

absl::Status CheckRegistration(const pb::JobRecord& job) {
  if (!job.has_register_family())
    return absl::InvalidArgumentError("the job is not a registration");
  if (job.register_family().family().empty()) {
    return absl::InvalidArgumentError("a family needs an id");
  }
  if (job.register_family().targets().empty()) {
    return absl::InvalidArgumentError(absl::StrCat(
        "the registration of family '", job.register_family().family(), "' has no targets"));
  }
  return absl::OkStatus();
}

pb::JobRecord NewJob(pb::JobRecord job, absl::Time now) {
  pb::JobRecord fresh;
  fresh.set_id(
      absl::StrCat(job.has_import_animation() ? "import-" : "register-", base::RandomHex(8)));
  fresh.set_state(pb::JobRecord::QUEUED);
  fresh.set_request_id(job.request_id());
  fresh.set_owner(job.owner());
  fresh.set_priority(job.priority());
  fresh.set_memory_bytes(job.memory_bytes());
  fresh.set_traceparent(job.traceparent());
  fresh.set_tracestate(job.tracestate());
  if (job.has_import_animation()) {
    *fresh.mutable_import_animation() = std::move(*job.mutable_import_animation());
  } else {
    *fresh.mutable_register_family() = std::move(*job.mutable_register_family());
    if (fresh.register_family().targets_size() > 1) fresh.set_state(pb::JobRecord::WAITING);
  }
  *fresh.mutable_create_time() = *fresh.mutable_update_time() = ToTimestamp(now);
  return fresh;
}

pb::JobRecord NewChild(const pb::JobRecord& parent, int target_index, absl::Time now) {
  pb::JobRecord child;
  child.set_id(absl::StrCat(parent.id(), ".", target_index));
  child.set_parent(parent.id());
  child.set_state(pb::JobRecord::QUEUED);
  child.set_owner(parent.owner());
  child.set_priority(parent.priority());
  child.set_memory_bytes(parent.memory_bytes());
  child.set_traceparent(parent.traceparent());
  child.set_tracestate(parent.tracestate());
  child.set_turn(parent.turn() + target_index);
  child.mutable_register_target()->set_family(parent.register_family().family());
  child.mutable_register_target()->set_target_index(target_index);
  *child.mutable_create_time() = *child.mutable_update_time() = ToTimestamp(now);
  return child;
}

absl::Status ErrorOfChild(const absl::Status& error, const pb::JobRecord& child,
                          const pb::JobRecord& parent) {
  return absl::Status(error.code(),
                      absl::StrCat("target '", TargetOf(child, parent), "': ", error.message()));
}

pb::AnimationRecord NewAnimation(pb::AnimationRecord animation, const pb::JobRecord& job,
                                 absl::Time now) {
  animation.set_state(pb::AnimationRecord::IMPORTING);
  animation.clear_error();
  animation.clear_blob();
  animation.set_owner(job.owner());
  int64_t upload_bytes = 0;
  for (const pb::SourceFile& file : job.import_animation().files()) {
    upload_bytes += file.size_bytes();
  }
  animation.set_upload_bytes(upload_bytes);
  *animation.mutable_create_time() = ToTimestamp(now);
  return animation;
}

void StartAttempt(const std::string& worker, absl::Time now, pb::JobRecord& job) {
  // Nothing but being queued changes the record of a queued job; one that is RUNNING lost its
  // worker.
  const bool was_queued = job.state() == pb::JobRecord::QUEUED;
  *job.mutable_queue_time() = was_queued ? job.update_time() : ToTimestamp(now);
  job.set_state(pb::JobRecord::RUNNING);
  job.set_attempts(job.attempts() + 1);
  job.set_worker(worker);
  job.clear_progress();
  job.clear_next_attempt_time();
  *job.mutable_start_time() = *job.mutable_update_time() = ToTimestamp(now);
  if (!job.has_first_start_time()) *job.mutable_first_start_time() = job.start_time();
}

void ReturnToQueue(absl::Time now, pb::JobRecord& job) {
  job.set_state(pb::JobRecord::QUEUED);
  job.clear_worker();
  job.clear_progress();
  job.clear_next_attempt_time();
  job.clear_start_time();
  *job.mutable_update_time() = ToTimestamp(now);
}

bool HasNewCheckpoint(const pb::JobRecord& job) {
  return job.has_checkpoint_time() && TimeUtil::TimestampToMicroseconds(job.checkpoint_time()) >=
                                          TimeUtil::TimestampToMicroseconds(job.start_time());
}

void HandBack(absl::Time now, pb::JobRecord& job) {
  job.set_handed_back(job.handed_back() + 1);
  job.set_handed_back_in_vain(HasNewCheckpoint(job) ? 0 : job.handed_back_in_vain() + 1);
  job.set_attempts(job.attempts() - 1);
  ReturnToQueue(now, job);
}

void NoteFailure(const absl::Status& error, bool lost, absl::Time now, pb::JobRecord& job) {
  pb::FailedAttempt attempt;
  *attempt.mutable_end_time() = ToTimestamp(now);
  attempt.set_worker(job.worker());
  *attempt.mutable_error() = ToRpcStatus(error);
  attempt.set_worker_lost(lost);
  AddFailure(attempt, job);
}

void TakeFailures(const pb::JobRecord& child, pb::JobRecord& parent) {
  const auto before = parent.failed_attempts();
  for (const pb::FailedAttempt& attempt : child.failed_attempts()) {
    const bool is_there = std::any_of(before.begin(), before.end(), [&](const auto& other) {
      return IsSameAttempt(attempt, other);
    });
    if (!is_there) AddFailureOfChild(attempt, child, parent);
  }
}

void Repeat(const absl::Status& why, absl::Time now, pb::JobRecord& child, pb::JobRecord& parent) {
  NoteFailure(why, /*lost=*/false, now, child);
  AddFailureOfChild(*child.failed_attempts().rbegin(), child, parent);
  CountForEnvironment(child);
  child.clear_result_blob();
  ReturnToQueue(now, child);
}

void WaitAgain(absl::Time now, pb::JobRecord& job) {
  job.set_attempts(job.attempts() - 1);
  ReturnToQueue(now, job);
  job.set_state(pb::JobRecord::WAITING);
}

void CountForEnvironment(pb::JobRecord& job) {
  job.set_attempts(job.attempts() - 1);
  job.set_environment_failures(job.environment_failures() + 1);
}

void CountLossAfterProgress(pb::JobRecord& job) {
  job.set_attempts(job.attempts() - 1);
  job.set_losses_after_progress(job.losses_after_progress() + 1);
}

int AttemptNumber(const pb::JobRecord& job) {
  return job.attempts() + job.environment_failures() + job.losses_after_progress();
}

int NumLosses(const pb::JobRecord& job) {
  const auto is_loss = [](const pb::FailedAttempt& attempt) { return attempt.worker_lost(); };
  return static_cast<int>(
      std::count_if(job.failed_attempts().begin(), job.failed_attempts().end(), is_loss));
}

void Succeed(absl::Time now, pb::JobRecord& job) {
  job.set_state(pb::JobRecord::SUCCEEDED);
  job.clear_checkpoint_blob();
  job.clear_checkpoint_time();
  job.mutable_progress()->set_fraction(1.0);
  job.mutable_progress()->set_seconds_left(0.0);
  *job.mutable_update_time() = ToTimestamp(now);
}

void Fail(const absl::Status& error, absl::Time now, pb::JobRecord& job) {
  job.set_state(absl::IsCancelled(error) ? pb::JobRecord::CANCELLED : pb::JobRecord::FAILED);
  job.clear_checkpoint_blob();
  job.clear_checkpoint_time();
  *job.mutable_error() = ToRpcStatus(error);
  *job.mutable_update_time() = ToTimestamp(now);
}

google::protobuf::Timestamp ToTimestamp(absl::Time time) {
  google::protobuf::Timestamp timestamp;
  const int64_t seconds = absl::ToUnixSeconds(time);  // rounds down
  timestamp.set_seconds(seconds);
  timestamp.set_nanos(
      static_cast<int32_t>(absl::ToInt64Nanoseconds(time - absl::FromUnixSeconds(seconds))));
  return timestamp;
}

absl::Time ToTime(const google::protobuf::Timestamp& timestamp) {
  return absl::FromUnixSeconds(timestamp.seconds()) + absl::Nanoseconds(timestamp.nanos());
}

google::rpc::Status ToRpcStatus(const absl::Status& status) {
  google::rpc::Status result;
  result.set_code(static_cast<int>(status.code()));
  result.set_message(std::string(status.message()));
  status.ForEachPayload([&](absl::string_view url, const absl::Cord& payload) {
    if (!absl::StartsWith(url, "type.googleapis.com/")) return;  // the program's own
    google::protobuf::Any& detail = *result.add_details();
    detail.set_type_url(std::string(url));
    detail.set_value(std::string(payload));
  });
  if (google::rpc::Status().ParseFromString(result.SerializeAsString())) return result;
  std::replace_if(
      result.mutable_message()->begin(), result.mutable_message()->end(),
      [](char c) { return static_cast<unsigned char>(c) >= 0x80; }, '?');
  return result;
}

absl::StatusOr<std::string> Serialize(const google::protobuf::MessageLite& record,
                                      const std::string& what) {
  std::string bytes = record.SerializeAsString();
  const std::unique_ptr<google::protobuf::MessageLite> copy(record.New());
  if (copy->ParseFromString(bytes)) return bytes;
  return absl::InvalidArgumentError(absl::StrCat(what, " holds a string that is not UTF-8"));
}

std::string PageToken(const std::string& list, const std::string& last_key) {
  return absl::WebSafeBase64Escape(absl::StrCat(list, "/", last_key));
}

absl::StatusOr<std::string> LastKey(const std::string& list, const std::string& token) {
  if (token.empty()) return std::string();
  std::string plain;
  const std::string prefix = absl::StrCat(list, "/");
  if (absl::WebSafeBase64Unescape(token, &plain) && plain.size() > prefix.size() &&
      plain.compare(0, prefix.size(), prefix) == 0) {
    return plain.substr(prefix.size());
  }
  return absl::InvalidArgumentError(
      absl::StrCat("page token '", absl::CHexEscape(token), "' is not from the list of ", list));
}

int PageSize(int page_size) {
  return page_size <= 0 ? kDefaultPageSize : std::min(page_size, kMaxPageSize);
}

}  // namespace liquidblend::store
