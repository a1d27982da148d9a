// Operations: long work on the server, imports and registrations.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "liquidblend/animation.h"
#include "liquidblend/family.h"

namespace liquidblend {

// Progress of a job.
struct Progress {
  std::string stage;
  double fraction = 0.0;  // of the whole job, [0, 1]
  int target_index = 0;
  int iteration = 0;
  int num_iterations = 0;
  double fit_energy = 0.0;
  double smoothness_energy = 0.0;
  int64_t num_inliers = 0;
  int64_t num_samples = 0;
  double seconds_elapsed = 0.0;
  double seconds_left = 0.0;  // 0: unknown
  int attempt = 0;            // 1 for the first worker that took the job
  std::string worker;
  std::optional<absl::Time> start_time;  // when work on it began
  std::optional<absl::Time> end_time;    // when it was done
  int priority = 0;
  std::string waiting_for;   // why it stays queued, if not for its turn alone
  int64_t memory_bytes = 0;  // estimate of its need; 0: not known
  // While it is queued after a failed attempt: the earliest time of the next one.
  std::optional<absl::Time> next_attempt_time;
  absl::Status last_failure;  // of the last failed attempt; OK: none
  std::string trace_id;       // of the trace that its spans are in; empty: none
  int handed_back = 0;        // how often a worker gave it back because it had to stop
};

// A job on the server: an import or a registration.
struct Operation {
  std::string name;     // operations/{id}
  std::string subject;  // the animation or family that it makes, if known
  Progress progress;
  bool done = false;
  absl::Status result;       // meaningful if done
  std::string error_reason;  // google.rpc.ErrorInfo's, of some failures: "VERDICT_TOO_LOW", say
  std::optional<Animation> animation;  // of a finished import
  std::optional<Family> family;        // of a finished registration
  int64_t version = 0;                 // that a finished registration has published; 0: not known
  Grade grade = Grade::kUnknown;       // the worst of any target of that version
};

}  // namespace liquidblend
