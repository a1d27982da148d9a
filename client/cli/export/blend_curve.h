// Blend of an export: the same for all frames, or a curve over time.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/cli/flags/blend_flags.h"

namespace liquidblend::cli {

// Weights, or a point in parameter space, over time: linear between two keys, constant before the
// first and after the last.
class BlendCurve {
 public:
  struct Key {
    double time_s = 0.0;
    Blend blend;
  };

  // Requires: at least one key, times rising; all blends have weights, as many as the first, or all
  // have parameters of the same names.
  explicit BlendCurve(std::vector<Key> keys) : keys_(std::move(keys)) {}

  bool is_constant() const { return keys_.size() == 1; }
  size_t num_keys() const { return keys_.size(); }
  Blend At(double time_s) const;

 private:
  std::vector<Key> keys_;
};

// Help texts of --weights and --parameters where they may be curves.
extern const char kWeightsCurveHelp[];
extern const char kParametersCurveHelp[];

// The blend of the flags. A value with a colon is a curve: keys TIME:VALUE, separated by slashes,
// such as "0:0,0/1.5:1,0" or "0:height=1/2:height=3". "@FILE" stands for the file's text, where
// line ends separate keys, too, and "#" begins a remark.
// Errors: kInvalidArgument, names flag, key and bad part; kNotFound if FILE cannot be read.
absl::StatusOr<BlendCurve> ToBlendCurve(const BlendFlags& flags);

}  // namespace liquidblend::cli
