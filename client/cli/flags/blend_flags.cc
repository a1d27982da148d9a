#include "client/cli/flags/blend_flags.h"

#include "absl/strings/str_cat.h"
#include "client/cli/flags/parse.h"
#include "client/src/status_macros.h"

namespace liquidblend::cli {

const char kParametersHelp[] =
    "NAME=VALUE[,..]: a point in the family's parameter space instead of weights; none unless "
    "given";
const char kExtrapolateHelp[] =
    "With --parameters: also outside of the hull of the family's points, by the nearest simplex";

void AddBlendFlags(CLI::App& command, BlendFlags& flags) {
  CLI::Option* weights = command.add_option(
      "--weights,-w", flags.weights,
      "W[,W..]: one per target; the source gets 1 - sum; -1 to 2; none unless given");
  CLI::Option* parameters =
      command.add_option("--parameters,-p", flags.parameters, kParametersHelp)->excludes(weights);
  command.add_flag("--extrapolate", flags.extrapolate, kExtrapolateHelp)->needs(parameters);
}

absl::StatusOr<Blend> ToBlend(const BlendFlags& flags) {
  Blend blend;
  blend.extrapolate = flags.extrapolate;
  if (!flags.weights.empty()) {
    LBC_ASSIGN_OR_RETURN(blend.weights, ParseNumbers("--weights", flags.weights));
  }
  if (!flags.parameters.empty()) {
    LBC_ASSIGN_OR_RETURN(const auto values, ParseAssignments("--parameters", flags.parameters));
    blend.parameters = Parameters(values.begin(), values.end());
  }
  return blend;
}

absl::StatusOr<Blend> ToRequiredBlend(const BlendFlags& flags) {
  LBC_ASSIGN_OR_RETURN(Blend blend, ToBlend(flags));
  if (!blend.empty()) return blend;
  return absl::InvalidArgumentError(
      "either --weights W[,W..] or --parameters NAME=VALUE[,..] is required");
}

std::string DescribeWeights(const std::vector<double>& weights, bool extrapolated, bool clamped) {
  return absl::StrCat(FormatNumbers(weights), extrapolated ? " (extrapolated)" : "",
                      clamped ? " (clamped: further out a falling part would not fall)" : "");
}

}  // namespace liquidblend::cli
