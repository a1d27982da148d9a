// Limits of weights beyond [0, 1]: a part that is detached in the first frame has to live for a
// while. A drop that would be let go below the surface merges before it falls, and the surface
// folds.
#pragma once

#include <vector>

#include "core/mesh/registered_family.h"

namespace liquidblend::blend {

// Shortest life of a detached part, frames; or as long as in the animation where it is shortest.
inline constexpr double kMinPartLifeFrames = 2.0;

// The limits of one family. The end of a part's life blends as all times do, linearly in ticks of
// the family's time axis, so each part gives one linear inequality of the weights.
// Threads: safe, immutable.
class LifeLimits {
 public:
  LifeLimits() = default;  // no limits
  // Requires: family passed Validate().
  explicit LifeLimits(const mesh::RegisteredFamily& family);

  // Moves weights that violate a limit towards the nearest blend of the inputs (weights of at least
  // 0 and a sum of at most 1), just as far as is necessary. Returns whether it moved them.
  // Requires: CheckWeights().ok().
  bool Clamp(std::vector<double>& weights) const;

  bool empty() const { return limits_.empty(); }

 private:
  // The part's life is source_end + sum of weights * growth, in ticks.
  struct Limit {
    double source_end = 0.0;
    std::vector<double> growth;  // per target; 0 where the part is not known
    double min_end = 0.0;
    double EndAt(const std::vector<double>& weights) const;
  };

  std::vector<Limit> limits_;
};

}  // namespace liquidblend::blend
