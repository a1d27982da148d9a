#include "worker/jobs/attempt/access.h"

#include <algorithm>
#include <span>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "core/base/log.h"
#include "core/base/random_id.h"
#include "core/base/retry.h"
#include "core/base/status_macros.h"
#include "core/base/steady_cond_var.h"
#include "core/store/catalog/retry.h"

namespace liquidblend::jobs {
namespace {

constexpr size_t kMaxRefusalBytes = 300;
// Interval at which the worker's record is renewed, so that it does not count as gone.
const absl::Duration kRecordInterval = store::kWorkerSilence / 8;

}  // namespace

absl::Status AccessOptions::Validate() const {
  if (first_pause <= absl::ZeroDuration()) {
    return absl::InvalidArgumentError(
        absl::StrCat("first_pause is out of range: ", absl::FormatDuration(first_pause)));
  }
  if (longest_pause >= first_pause) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("longest_pause is out of range: ", absl::FormatDuration(longest_pause)));
}

bool IsRefusal(const absl::Status& error) { return absl::IsPermissionDenied(error); }

std::string RefusalOf(const absl::Status& error) {
  std::string text(error.message().substr(0, kMaxRefusalBytes));
  for (char& c : text) {
    if (!absl::ascii_isprint(static_cast<unsigned char>(c))) c = '?';
  }
  return text.empty() ? "refused" : text;
}

Access::Access(store::Catalog& catalog, store::BlobStore& blobs, const StopSignal& stop,
               store::pb::WorkerRecord worker, const AccessOptions& options)
    : catalog_(catalog),
      blobs_(blobs),
      stop_(stop),
      worker_(std::move(worker)),
      options_(options) {}

void Access::AwaitAfter(const absl::Status& refusal) {
  base::LogWarning(absl::StrCat(
      worker_.name(), " takes no jobs until its access is restored: ", refusal.ToString()));
  const base::SteadyClock::time_point begin = base::SteadyClock::now();
  Record(refusal);
  while (Pause()) {
    const absl::Status recorded = catalog_.RecordWorker(worker_);
    if (!recorded.ok() && !base::IsTransient(recorded)) {
      return base::LogWarning(
          absl::StrCat(worker_.name(), " waits no longer: ", recorded.ToString()));
    }
    const absl::Status probed = recorded.ok() ? ProbeBlobs() : recorded;
    if (probed.ok()) {
      Record(absl::OkStatus());
      return base::LogInfo(
          absl::StrCat(worker_.name(), " takes jobs again, after ",
                       absl::FormatDuration(absl::Trunc(base::Since(begin), absl::Seconds(1)))));
    }
    Record(probed);
  }
}

// Returns whether to go on.
bool Access::Pause() {
  store::RetryOptions pauses;
  pauses.first_pause = options_.first_pause;
  pauses.longest_pause = options_.longest_pause;
  absl::Duration left = store::PauseAfter(++num_pauses_, pauses);
  while (left > absl::ZeroDuration()) {
    const absl::Duration slice = std::min(left, kRecordInterval);
    if (stop_.WaitFor(slice)) return false;
    left -= slice;
    catalog_.RecordWorker(worker_).IgnoreError();  // the next probe says what is wrong
  }
  return !stop_.is_requested();
}

// Each kind of request that jobs make. What is left behind by a probe that fails is garbage.
absl::Status Access::ProbeBlobs() {
  const std::string text = absl::StrCat("probe of ", worker_.name(), " ", base::RandomHex(16));
  LB_ASSIGN_OR_RETURN(const store::BlobId probe,
                      store::PutBlob(blobs_, std::as_bytes(std::span(text.data(), text.size()))));
  LB_RETURN_IF_ERROR(blobs_.Verify(probe));
  // Jobs delete checkpoints, but can do without: a worker may have no right to delete.
  const absl::Status deleted = blobs_.Delete(probe);
  return absl::IsPermissionDenied(deleted) ? absl::OkStatus() : deleted;
}

void Access::Record(const absl::Status& refusal) {
  worker_.set_refusal(refusal.ok() ? "" : RefusalOf(refusal));
  const absl::Status recorded = catalog_.RecordWorker(worker_);
  if (!recorded.ok())
    base::LogInfo(absl::StrCat("cannot record the worker: ", recorded.ToString()));
}

}  // namespace liquidblend::jobs
