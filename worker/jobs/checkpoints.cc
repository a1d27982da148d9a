#include "worker/jobs/checkpoints.h"

#include <utility>
#include <variant>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "core/base/fault_point.h"
#include "core/base/log.h"
#include "core/base/retry.h"
#include "core/base/status_macros.h"
#include "worker/jobs/attempt/run_guarded.h"
#include "worker/jobs/checkpoint_file.h"
#include "worker/registration/fit/state.h"

namespace liquidblend::jobs {
namespace {

using registration::CompetitionState;
using registration::IterationState;
using registration::RegistrationState;
using registration::SharpenState;

// Whether nothing comes after it for a while, or a lot went into it.
bool IsMilestone(const RegistrationState& state) {
  const auto* iterations = std::get_if<IterationState>(&state);
  if (const auto* const competition = std::get_if<CompetitionState>(&state)) {
    iterations = competition->next ? &*competition->next : nullptr;
  }
  return iterations == nullptr || iterations->last.iteration == iterations->last.num_iterations;
}

std::string Describe(const RegistrationState& state) {
  if (const auto* const finer = std::get_if<SharpenState>(&state)) {
    return absl::StrCat("round ", finer->num_rounds, " of finer nodes");
  }
  if (const auto* const competition = std::get_if<CompetitionState>(&state)) {
    const int num_done = 1 + competition->num_others;
    if (!competition->next) return absl::StrCat("pairing ", num_done);
    return absl::StrCat("iteration ", competition->next->last.iteration, " of pairing ",
                        num_done + 1);
  }
  return absl::StrCat("iteration ", std::get<IterationState>(state).last.iteration);
}

}  // namespace

absl::Status CheckpointOptions::Validate() const {
  if (iterations < 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("checkpoint iterations are out of range: ", iterations));
  }
  if (interval < absl::ZeroDuration()) {
    return absl::InvalidArgumentError(
        absl::StrCat("checkpoint interval is out of range: ", absl::FormatDuration(interval)));
  }
  if (patience < absl::ZeroDuration()) {
    return absl::InvalidArgumentError(
        absl::StrCat("checkpoint patience is out of range: ", absl::FormatDuration(patience)));
  }
  return absl::OkStatus();
}

Checkpoints::Checkpoints(store::Catalog& catalog, store::BlobStore& blobs,
                         const store::Lease& lease, const CheckpointOptions& options)
    : catalog_(catalog),
      blobs_(blobs),
      job_id_(lease.job.id()),
      lease_id_(lease.lease_id),
      first_(lease.job.checkpoint_blob()),
      options_(options),
      saved_at_(base::SteadyClock::now()) {
  if (!first_.empty()) earlier_.push_back(first_);
}

Checkpoints::~Checkpoints() { End(/*is_done=*/false); }

absl::StatusOr<std::optional<RegistrationState>> Checkpoints::Begin(std::string fingerprint) {
  fingerprint_ = std::move(fingerprint);
  if (options_.iterations > 0) {
    absl::MutexLock lock(&mutex_);
    thread_ = std::thread([this] { Run(); });  // may throw
    is_running_ = true;
  }
  if (first_.empty()) return std::optional<RegistrationState>();
  absl::StatusOr<RegistrationState> state = Load(fingerprint_);
  if (state.ok()) {
    base::LogInfo(absl::StrCat("job ", job_id_, ": resumed after ", Describe(*state)));
    return std::optional<RegistrationState>(*std::move(state));
  }
  if (base::IsTransient(state.status())) return state.status();
  LogTrouble("begins anew, as its checkpoint cannot be used", state.status());
  return std::optional<RegistrationState>();
}

absl::StatusOr<RegistrationState> Checkpoints::Load(const std::string& fingerprint) {
  const std::string name = absl::StrCat("checkpoint ", first_);
  const absl::StatusOr<std::shared_ptr<const store::Blob>> blob = blobs_.Open(first_);
  if (!blob.ok()) {
    return absl::Status(blob.status().code(), absl::StrCat(name, ": ", blob.status().message()));
  }
  absl::StatusOr<Checkpoint> checkpoint = ReadCheckpoint(**blob, name);  // copies it
  LB_RETURN_IF_ERROR((*blob)->Check());
  LB_RETURN_IF_ERROR(checkpoint.status());
  if (checkpoint->label.fingerprint == fingerprint) return std::move(checkpoint->state);
  return absl::FailedPreconditionError(
      absl::StrCat(name, " is of ", checkpoint->label.fingerprint, ", and this registration is ",
                   fingerprint, ": another program, or other inputs or options"));
}

void Checkpoints::Offer(RegistrationState state) {
  auto newest = std::make_shared<const RegistrationState>(std::move(state));
  absl::MutexLock lock(&mutex_);
  newest_.swap(newest);
  newest_at_ = base::SteadyClock::now();
  ++num_offered_;
}

void Checkpoints::Flush() {
  absl::MutexLock lock(&mutex_);
  if (!is_running_) return;
  num_flushed_ = num_offered_;  // newer ones do not count: they may come faster than they are saved
  urgent_.SignalAll();
  const auto is_flushed = [this] {
    mutex_.AssertHeld();
    return IsFlushed();
  };
  flushed_.Await(&mutex_, is_flushed, options_.patience);
}

bool Checkpoints::HasNew() const {
  absl::MutexLock lock(&mutex_);
  return !saved_.empty();
}

std::string Checkpoints::DescribeSaved() const {
  absl::MutexLock lock(&mutex_);
  const absl::Duration lost = absl::Trunc(base::Since(saved_at_), absl::Milliseconds(100));
  const std::string work = absl::StrCat("lost is the work of ", absl::FormatDuration(lost));
  if (saved_.empty()) return absl::StrCat("without a new checkpoint; ", work);
  return absl::StrCat("with a checkpoint after ", saved_, "; ", work, " since then");
}

void Checkpoints::End(bool is_done) {
  {
    absl::MutexLock lock(&mutex_);
    is_ended_ = true;
    urgent_.SignalAll();
    flushed_.SignalAll();
  }
  if (thread_.joinable()) thread_.join();
  if (is_done) DeleteEarlier();
}

void Checkpoints::Run() {
  while (const std::shared_ptr<const State> state = AwaitNext()) {
    const absl::Status saved = Guarded("no checkpoint", [&] {
      Save(*state);
      return absl::OkStatus();
    });
    if (!saved.ok()) {
      Guarded("log",
              [&] {  // it needs memory, too
                LogTrouble("cannot make a checkpoint", saved);
                return absl::OkStatus();
              })
          .IgnoreError();
    }
    absl::MutexLock lock(&mutex_);
    num_done_ = num_taken_;
    flushed_.SignalAll();
  }
}

std::shared_ptr<const RegistrationState> Checkpoints::AwaitNext() {
  absl::MutexLock lock(&mutex_);
  const auto is_urgent = [this] {
    mutex_.AssertHeld();
    return IsUrgent();
  };
  urgent_.Await(&mutex_, is_urgent, options_.interval);
  mutex_.Await(absl::Condition(this, &Checkpoints::IsDueOrUrgent));
  if (is_ended_) return nullptr;
  num_taken_ = num_offered_;
  taken_at_ = newest_at_;
  return std::exchange(newest_, nullptr);  // they may be large
}

bool Checkpoints::IsDue() const {
  const int64_t num_new = num_offered_ - num_taken_;
  return num_new >= options_.iterations || (num_new > 0 && IsMilestone(*newest_));
}

bool Checkpoints::IsUrgent() const { return is_ended_ || num_taken_ < num_flushed_; }

bool Checkpoints::IsFlushed() const { return is_ended_ || num_done_ >= num_flushed_; }

void Checkpoints::Save(const RegistrationState& state) {
  const absl::Time begin = absl::Now();
  const absl::StatusOr<store::BlobId> blob = Write(state);
  if (!blob.ok()) return LogTrouble("cannot write a checkpoint", blob.status());
  base::FaultPoint("checkpoint.after_write");
  const absl::Status recorded = catalog_.SaveCheckpoint(lease_id_, *blob);
  if (absl::IsAborted(recorded)) {  // the job is no longer ours, and has not heard of this one
    earlier_ = {*blob};
    DeleteEarlier();
    absl::MutexLock lock(&mutex_);
    is_ended_ = true;
    flushed_.SignalAll();
    return;
  }
  if (!recorded.ok()) {  // the record may name this one or the one before: both stay
    earlier_.push_back(*blob);
    return LogTrouble("cannot record a checkpoint", recorded);
  }
  DeleteEarlier();
  earlier_ = {*blob};
  base::Log(base::LogLevel::kDebug,
            absl::StrCat("job ", job_id_, ": checkpoint after ", Describe(state)),
            {{"ms", absl::StrCat(absl::ToInt64Milliseconds(absl::Now() - begin))}});
  absl::MutexLock lock(&mutex_);
  saved_ = Describe(state);
  saved_at_ = taken_at_;
}

absl::StatusOr<store::BlobId> Checkpoints::Write(const RegistrationState& state) {
  base::FaultPoint("checkpoint.before_write");
  LB_ASSIGN_OR_RETURN(const std::unique_ptr<store::BlobWriter> out, blobs_.Create());
  LB_RETURN_IF_ERROR(WriteCheckpoint({fingerprint_, lease_id_, ++num_written_}, state, *out));
  return out->Commit();
}

void Checkpoints::DeleteEarlier() {
  for (const store::BlobId& id : std::exchange(earlier_, {})) {
    const absl::Status deleted = blobs_.Delete(id);
    if (!deleted.ok()) LogTrouble("cannot delete an old checkpoint", deleted);
  }
}

void Checkpoints::LogTrouble(const std::string& what, const absl::Status& status) const {
  base::LogWarning(absl::StrCat("job ", job_id_, ": ", what, ": ", status.ToString()));
}

}  // namespace liquidblend::jobs
