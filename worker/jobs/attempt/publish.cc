#include "worker/jobs/attempt/publish.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "core/base/log.h"
#include "core/base/retry.h"
#include "core/base/status_macros.h"
#include "core/base/steady_cond_var.h"

namespace liquidblend::jobs {
namespace {

constexpr absl::Duration kCheckInterval = absl::Milliseconds(100);
constexpr double kJitter = 0.5;  // many workers may have failed at one time

// Whether the error may pass while the worker waits here. One that is refused waits elsewhere,
// where it says so (Access).
bool MayPass(const absl::Status& error) {
  return base::IsTransient(error) && !absl::IsPermissionDenied(error);
}

// Waits as long as the job may go on. Errors: keeper.CheckForPublishing()'s.
absl::Status Wait(const LeaseKeeper& keeper, absl::Duration time) {
  const base::SteadyClock::time_point begin = base::SteadyClock::now();
  while (base::Since(begin) < time) {
    absl::SleepFor(std::min(time, kCheckInterval));
    LB_RETURN_IF_ERROR(keeper.CheckForPublishing());
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status PublishWhileLeased(const LeaseKeeper& keeper,
                                absl::FunctionRef<absl::Status()> publish,
                                const PublishOptions& options) {
  const base::SteadyClock::time_point begin = base::SteadyClock::now();
  LB_RETURN_IF_ERROR(keeper.CheckForPublishing());
  for (int num_failures = 1;; ++num_failures) {
    const absl::Status published = publish();
    const absl::Duration pause = base::Jittered(
        base::ExponentialPause(num_failures, options.first_pause, options.longest_pause), kJitter);
    if (!MayPass(published) || base::Since(begin) + pause > options.longest) {
      return published;
    }
    base::LogWarning(absl::StrCat("job ", keeper.job().id(),
                                  ": not published yet, will try again: ", published.ToString()));
    LB_RETURN_IF_ERROR(Wait(keeper, pause));
  }
}

}  // namespace liquidblend::jobs
