// Repeats calls that failed because the server could not be reached.
#pragma once

#include <functional>
#include <random>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "liquidblend/client.h"

namespace liquidblend::client {

// Counts attempts and says how long to wait before the next one. Threads: one.
class Backoff {
 public:
  explicit Backoff(const RetryOptions& options);

  // True if `status` is kUnavailable and an attempt is left.
  bool ShouldRetry(const absl::Status& status) const;

  // The next wait: doubles up to max_backoff, times a random number in [0.5, 1]. Counts an attempt.
  absl::Duration NextWait();

  // The connection worked: start counting from the beginning.
  void Reset();

  int num_attempts() const { return num_attempts_; }

 private:
  RetryOptions options_;
  int num_attempts_ = 1;
  std::minstd_rand random_;
};

// Runs `call` until it succeeds, fails for another reason, or the attempts are used up; then the
// message says how many there were.
absl::Status RetryUnavailable(const RetryOptions& options,
                              const std::function<absl::Status(int attempt)>& call);

}  // namespace liquidblend::client
