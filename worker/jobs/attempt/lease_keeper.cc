#include "worker/jobs/attempt/lease_keeper.h"

#include <algorithm>
#include <exception>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/log.h"

namespace liquidblend::jobs {
namespace {

constexpr double kReportedBytesPerSecond = 256 << 10;
constexpr absl::Duration kWarnInterval = absl::Seconds(10);  // an outage may last for hours

// The catalog reads the record and writes it anew at each report.
absl::Duration ReportInterval(const store::pb::JobRecord& job, const LeaseOptions& options) {
  const absl::Duration of_record =
      absl::Seconds(static_cast<double>(job.ByteSizeLong()) / kReportedBytesPerSecond);
  return std::min(std::max(options.report_interval, of_record), options.duration / 3);
}

}  // namespace

absl::Status LeaseOptions::Validate() const {
  if (duration < absl::Milliseconds(100)) {
    return absl::InvalidArgumentError(
        absl::StrCat("lease duration is below 100 ms: ", absl::FormatDuration(duration)));
  }
  if (duration > store::kLongestLease) {
    return absl::InvalidArgumentError(absl::StrCat("lease duration is above ",
                                                   absl::FormatDuration(store::kLongestLease), ": ",
                                                   absl::FormatDuration(duration)));
  }
  if (report_interval <= absl::ZeroDuration()) {
    return absl::InvalidArgumentError(
        absl::StrCat("report_interval is out of range: ", absl::FormatDuration(report_interval)));
  }
  return absl::OkStatus();
}

LeaseKeeper::LeaseKeeper(store::Catalog& catalog, store::Lease lease, const StopSignal& stop,
                         const LeaseOptions& options, std::function<std::string()> before_release)
    : catalog_(catalog),
      lease_(std::move(lease)),
      stop_(stop),
      options_(options),
      report_interval_(ReportInterval(lease_.job, options)),
      before_release_(std::move(before_release)),
      renewed_(base::SteadyClock::now()),
      thread_([this] { Keep(); }) {}

LeaseKeeper::~LeaseKeeper() {
  {
    absl::MutexLock lock(&mutex_);
    is_done_ = true;
    done_.SignalAll();
  }
  thread_.join();
}

void LeaseKeeper::Report(const store::pb::JobProgress& progress) {
  absl::MutexLock lock(&mutex_);
  progress_ = progress;
  is_progress_new_ = true;
}

absl::Status LeaseKeeper::Check() const {
  absl::MutexLock lock(&mutex_);
  is_error_reported_ = is_error_reported_ || !state_.ok();
  return state_;
}

absl::Status LeaseKeeper::CheckForPublishing() const {
  absl::MutexLock lock(&mutex_);
  return has_run_out_ ? absl::OkStatus() : state_;
}

bool LeaseKeeper::is_released() const {
  absl::MutexLock lock(&mutex_);
  return is_released_;
}

void LeaseKeeper::Keep() {
  const absl::Duration pause = std::min(options_.report_interval, options_.duration / 3);
  while (true) {
    bool is_due = false;
    {
      absl::MutexLock lock(&mutex_);
      const auto is_done = [this] {
        mutex_.AssertHeld();
        return is_done_;
      };
      if (done_.Await(&mutex_, is_done, pause)) return;
      is_due = IsRenewalDue();
    }
    try {
      if (stop_.is_requested()) return Release();
      if (is_due) Renew();
      if (HasEnded()) return;
    } catch (const std::exception&) {
      // The job has used up the memory that it may have; it is about to fail and to free that. The
      // next round tries again. Nothing is said here, as that would need memory, too.
    }
  }
}

bool LeaseKeeper::IsRenewalDue() const {
  return base::Since(renewed_) >= (is_progress_new_ ? report_interval_ : options_.duration / 3);
}

void LeaseKeeper::Renew() {
  store::pb::JobProgress progress;
  {
    absl::MutexLock lock(&mutex_);
    progress = progress_;
    is_progress_new_ = false;
  }
  const base::SteadyClock::time_point begin = base::SteadyClock::now();
  const absl::StatusOr<store::JobControl> control =
      catalog_.Heartbeat(lease_id(), options_.duration, progress);
  if (absl::IsAborted(control.status())) return End(control.status());
  if (absl::IsFailedPrecondition(control.status())) {
    return End(absl::UnavailableError(control.status().message()));
  }
  absl::MutexLock lock(&mutex_);
  if (control.ok()) return NoteRenewal(begin, *control);
  if (!warned_.has_value() || base::Since(*warned_) >= kWarnInterval) {
    warned_ = base::SteadyClock::now();
    base::LogWarning(absl::StrCat("job ", job().id(),
                                  ": cannot renew the lease: ", control.status().ToString()));
  }
  if (state_.ok() && absl::FromChrono(begin - renewed_) > options_.duration) {
    state_ = absl::UnavailableError(absl::StrCat("the lease of job '", job().id(),
                                                 "' has run out: ", control.status().message()));
    has_run_out_ = true;
  }
}

// An error that the work has seen stays: it has ended, or is about to.
void LeaseKeeper::NoteRenewal(base::SteadyClock::time_point begin,
                              const store::JobControl& control) {
  renewed_ = begin;
  warned_.reset();
  if (has_run_out_ && !is_error_reported_) {
    state_ = absl::OkStatus();
    has_run_out_ = false;
    base::LogInfo(absl::StrCat("job ", job().id(), ": the lease is renewed, the work goes on"));
  }
  if (!control.cancel_requested) return;
  state_ = absl::CancelledError("cancelled on request");
  has_run_out_ = false;
}

void LeaseKeeper::Release() {
  const std::string saved = before_release_ ? before_release_() : "";
  const absl::Status released = catalog_.ReleaseJob(lease_id());
  if (released.ok()) {
    base::LogInfo(
        absl::StrCat("job ", job().id(), ": handed back", saved.empty() ? "" : " ", saved));
  } else {
    base::LogWarning(
        absl::StrCat("job ", job().id(), ": cannot return it to the queue: ", released.ToString()));
  }
  End(absl::UnavailableError("the worker is stopping"), /*is_released=*/true);
}

void LeaseKeeper::End(const absl::Status& reason, bool is_released) {
  absl::MutexLock lock(&mutex_);
  state_ = reason;
  is_released_ = is_released;
  has_run_out_ = false;
  has_ended_ = true;
}

bool LeaseKeeper::HasEnded() const {
  absl::MutexLock lock(&mutex_);
  return has_ended_;
}

}  // namespace liquidblend::jobs
