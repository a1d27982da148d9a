// Control of frames' level of detail and format, by what they cost.
#pragma once

#include <cstdint>

#include "client/player/frame_source.h"
#include "client/player/schedule.h"

namespace liquidblend::player {

struct DetailOptions {
  int finest = 0;    // level of detail
  int coarsest = 0;  // >= finest
  bool may_change_format = true;
  int num_threads = 1;  // that get frames
};

// Looks at what was shown and missed in the last second of the program's clock. If frames are
// missed, then, one step a second: where waiting for them takes longer than decoding, Draco, which
// is smaller; otherwise the next coarser level. After four seconds without a miss, if the threads
// have time to spare, one step back; if that is missed, the next one comes twice as late.
// Threads: one at a time.
class DetailControl {
 public:
  explicit DetailControl(const DetailOptions& options)
      : options_(options), level_(options.finest) {}

  void AddCost(const FrameCost& cost);
  // Returns whether the level or the format has changed.
  bool Update(double now, const ScheduleCounts& counts);

  int level() const { return level_; }
  FrameFormat format() const { return format_; }

 private:
  bool StepDown(double wait_s, double decode_s);
  bool StepUp(double busy_share);

  const DetailOptions options_;
  int level_;
  FrameFormat format_ = FrameFormat::kMeshopt;
  double began_ = -1.0;  // of the second; negative: not begun
  double calm_since_ = 0.0;
  double stepped_up_ = -1e9;    // when
  double calm_needed_s_ = 4.0;  // without a miss, before a step back
  ScheduleCounts before_;
  FrameCost cost_;  // of the second
};

}  // namespace liquidblend::player
