// Flags that say which blend: weights, or a point in parameter space. Shared by the commands that
// ask for frames.
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

// What the flags say; both empty if they say nothing.
struct Blend {
  std::vector<double> weights;
  Parameters parameters;
  bool extrapolate = false;

  bool empty() const { return weights.empty() && parameters.empty(); }
};

// `flags` must outlive the parser.
void AddBlendFlags(CLI::App& command, BlendFlags& flags);

// What --parameters and --extrapolate are, for --help.
extern const char kParametersHelp[];
extern const char kExtrapolateHelp[];

// Errors: kInvalidArgument, names the flag and the bad part.
absl::StatusOr<Blend> ToBlend(const BlendFlags& flags);

// Errors: also kInvalidArgument if the flags say nothing.
absl::StatusOr<Blend> ToRequiredBlend(const BlendFlags& flags);

}  // namespace liquidblend::cli
