// Long work on the server: imports and registrations.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "liquidblend/animation.h"
#include "liquidblend/family.h"

namespace liquidblend {

// How far a job is.
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
};

// A job on the server: an import or a registration.
struct Operation {
  std::string name;     // operations/{id}
  std::string subject;  // the animation or family that it makes, if known
  Progress progress;
  bool done = false;
  absl::Status result;                 // meaningful if done
  std::optional<Animation> animation;  // of a finished import
  std::optional<Family> family;        // of a finished registration
};

}  // namespace liquidblend
