// Repeats calls that failed because the server could not be reached, or asked to try again later.
//
// Why not gRPC's own retries, which servers.cc turns off: they make at most five attempts, all of
// them on one channel, and do not read google.rpc.RetryInfo. Here a call goes on to other servers
// and waits as long as RetryInfo says. Transfers over HTTP are repeated by the same rules.
#pragma once

#include <functional>
#include <optional>
#include <random>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "liquidblend/client.h"

namespace liquidblend::client {

// Counts attempts and computes the waits between them, according to RetryOptions.
// Threads: one.
class Backoff {
 public:
  explicit Backoff(const RetryOptions& options);

  // Whether another attempt should follow one that ended with `status`. Keeps the delay that the
  // server asks for.
  bool ShouldRetry(const absl::Status& status);

  // The next wait: the delay that the server asks for, times a random number in [1, 1.25]; without
  // one, a delay that doubles up to max_backoff, times a random number in [0.5, 1]. Counts an
  // attempt.
  // Requires: ShouldRetry() was true.
  absl::Duration NextWait();

  // The connection worked: resets the counts.
  void Reset();

  int num_attempts() const { return num_attempts_; }

 private:
  absl::Duration Times(absl::Duration wait, double lowest, double highest);

  RetryOptions options_;
  int num_attempts_ = 1;
  int num_unreached_ = 1;                // failed attempts without a delay from the server
  absl::Duration waited_;                // because of the server's delays
  std::optional<absl::Duration> asked_;  // of the last attempt
  std::minstd_rand random_;
};

// Likewise for calls that may be repeated for longer: when the attempts of Backoff are used up,
// attempts go on until the server has been away for RetryOptions::patience.  Threads: one.
class PatientBackoff {
 public:
  explicit PatientBackoff(const RetryOptions& options);

  // The pause after an attempt that ended with `status` at `now`; nothing: give up. While the
  // server is away it is 0.1 to 1 s, regardless of delays from the server, since a restart takes a
  // short time.
  std::optional<absl::Duration> NextPause(const absl::Status& status, absl::Time now);

  // The connection worked: resets the counts.
  void Reset();

  int num_attempts() const { return num_attempts_; }

 private:
  const RetryOptions options_;
  Backoff backoff_;
  int num_attempts_ = 1;
  absl::Time lost_at_ = absl::InfiniteFuture();  // begin of the server's absence
};

// Runs `call` until it succeeds, fails for another reason, or attempts or patience are used up;
// then the message says how many attempts there were.
absl::Status RetryUnavailable(const RetryOptions& options,
                              const std::function<absl::Status(int attempt)>& call);

// Likewise, with a PatientBackoff.
absl::Status RetryPatiently(const RetryOptions& options, const std::function<absl::Status()>& call);

}  // namespace liquidblend::client
