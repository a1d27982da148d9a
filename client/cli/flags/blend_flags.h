// Flags of a blend: weights, or a point in parameter space. Shared by the commands that request
// frames.
#pragma once

#include <CLI/App.hpp>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "liquidblend/parameter_space.h"

namespace liquidblend::cli {

struct BlendFlags {
  std::string weights;
  std::string parameters;
  bool extrapolate = false;
};

// Values of the flags; both empty without flags.
struct Blend {
  std::vector<double> weights;
  Parameters parameters;
  bool extrapolate = false;

  bool empty() const { return weights.empty() && parameters.empty(); }
};

// `flags` must outlive the parser.
void AddBlendFlags(CLI::App& command, BlendFlags& flags);

// Help text of --parameters and --extrapolate.
extern const char kParametersHelp[];
extern const char kExtrapolateHelp[];

// Errors: kInvalidArgument, names the flag and the bad part.
absl::StatusOr<Blend> ToBlend(const BlendFlags& flags);

// Errors: also kInvalidArgument without flags.
absl::StatusOr<Blend> ToRequiredBlend(const BlendFlags& flags);

// The weights of a frame as text, and in which way they are not those that were asked for.
std::string DescribeWeights(const std::vector<double>& weights, bool extrapolated, bool clamped);

}  // namespace liquidblend::cli
