// Repeats calls that failed because the server could not be reached, or asked to try again later.
#pragma once

#include <functional>
#include <optional>
#include <random>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "liquidblend/client.h"

namespace liquidblend::client {

// Counts attempts and says how long to wait before the next one, as RetryOptions has it.
// Threads: one.
class Backoff {
 public:
  explicit Backoff(const RetryOptions& options);

  // Whether another attempt should follow one that ended so. Takes note of the delay that the
  // server asks for.
  bool ShouldRetry(const absl::Status& status);

  // The next wait: the delay that the server asks for, times a random number in [1, 1.25]; without
  // one, what doubles up to max_backoff, times a random number in [0.5, 1]. Counts an attempt.
  // Requires: ShouldRetry() was true.
  absl::Duration NextWait();

  // The connection worked: start counting from the beginning.
  void Reset();

  int num_attempts() const { return num_attempts_; }

 private:
  absl::Duration Times(absl::Duration wait, double lowest, double highest);

  RetryOptions options_;
  int num_attempts_ = 1;
  int num_unreached_ = 1;                // attempts whose end did not say when to try again
  absl::Duration waited_;                // because the server asked for it
  std::optional<absl::Duration> asked_;  // by the end of the last attempt
  std::minstd_rand random_;
};

// Likewise for what can be repeated for as long as the caller has patience: when the attempts of
// Backoff are used up, attempts go on until RetryOptions::patience is over since the server went
// away.  Threads: one.
class PatientBackoff {
 public:
  explicit PatientBackoff(const RetryOptions& options);

  // The pause before the attempt after one that ended so at `now`; none: give up. While the server
  // is away it is 0.1 to 1 s, whatever the server asks for: a restart is soon over.
  std::optional<absl::Duration> NextPause(const absl::Status& status, absl::Time now);

  // The connection worked: start counting from the beginning.
  void Reset();

  int num_attempts() const { return num_attempts_; }

 private:
  const RetryOptions options_;
  Backoff backoff_;
  int num_attempts_ = 1;
  absl::Time lost_at_ = absl::InfiniteFuture();  // since then nothing has come
};

// Runs `call` until it succeeds, fails for another reason, or attempts or patience are used up;
// then the message says how many attempts there were.
absl::Status RetryUnavailable(const RetryOptions& options,
                              const std::function<absl::Status(int attempt)>& call);

// Likewise, with a PatientBackoff.
absl::Status RetryPatiently(const RetryOptions& options, const std::function<absl::Status()>& call);

}  // namespace liquidblend::client
