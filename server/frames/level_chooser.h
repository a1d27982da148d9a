// Choice of the level of detail that a stream's connection can carry. Knows no gRPC and no clock.
#pragma once

#include "absl/time/time.h"

namespace liquidblend::server {

// The number of levels by which frames are coarser than requested: one more when writing takes most
// of a period, one less as a trial after a quiet time, which doubles each time that a trial fails.
// Threads: one at a time.
class LevelChooser {
 public:
  // Number of levels beyond the requested one, >= 0.
  int num_coarser() const { return num_coarser_; }

  // Records that a frame has been written.
  //   took         from the beginning of the write to its end
  //   period       between two frames, > 0
  //   max_coarser  number of coarser levels that the family has
  void OnWritten(absl::Duration took, absl::Duration period, int max_coarser, absl::Duration now);

 private:
  void GoCoarser(absl::Duration now);
  void GoFiner(absl::Duration now);

  int num_coarser_ = 0;
  double busy_ = 0.0;                                 // running mean of took / period
  absl::Duration since_ = -absl::InfiniteDuration();  // the last step
  bool was_trial_ = false;                            // the last step was to a finer level
  absl::Duration quiet_ = kFirstQuiet;                // before the next trial

  static constexpr absl::Duration kFirstQuiet = absl::Seconds(2);
  static constexpr absl::Duration kMaxQuiet = absl::Minutes(1);
};

}  // namespace liquidblend::server
