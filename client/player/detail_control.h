// Control of frames' level of detail and format, by what they cost.
#pragma once

#include <cstdint>
#include <optional>

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
// missed, then, one step a second: where bytes come slowly, Draco, which is smaller; otherwise the
// next coarser level. Draco that does not help, or takes longer to decode than to come, is given up
// for a minute. After four seconds without a miss, if the threads have time to spare, one step
// back; if that is missed, the next one comes twice as late. Threads: one at a time.
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
  // Sums over the frames of a second.
  struct Sums {
    FrameCost cost;
    int64_t num_frames = 0;
    double seconds_per_frame() const;
  };

  bool StepDown(const Sums& sums, double now);
  bool StepUp(double busy_share);
  bool GiveUpDraco(const Sums& sums, bool is_missing, double now);

  const DetailOptions options_;
  int level_;
  FrameFormat format_ = FrameFormat::kMeshopt;
  std::optional<double> began_;  // of the second
  bool is_warm_ = false;         // the first second has passed, of which nothing is concluded
  double calm_since_ = 0.0;
  double stepped_up_ = -1e9;    // when
  double calm_needed_s_ = 4.0;  // without a miss, before a step back
  ScheduleCounts before_;
  Sums sums_;                    // of the second
  double before_draco_s_ = 0.0;  // a frame, on trial; 0: no trial
  double draco_barred_until_ = -1e9;
};

}  // namespace liquidblend::player
