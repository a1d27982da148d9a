// Which level of detail a stream's connection can carry. Knows no gRPC and no clock.
#pragma once

#include "absl/time/time.h"

namespace liquidblend::server {

// How much coarser than asked for frames have to be: one level more when writing them takes most of
// the time between two, one less as a trial after a quiet while; the while doubles each time that a
// trial fails.  Threads: one at a time.
class LevelChooser {
 public:
  // Levels beyond what is asked for, >= 0.
  int num_coarser() const { return num_coarser_; }

  // A frame has been written.
  //   took         from the beginning of the write to its end
  //   period       between two frames, > 0
  //   max_coarser  how many levels coarser the family has to offer
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
