#include "core/frames/blend_weights.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/base/status_macros.h"

namespace liquidblend::frames {
namespace {

constexpr size_t kMaxShownParameter = 80;  // of a wrong name, in a message

// The values of the parameters in the order of the names.
absl::StatusOr<std::vector<double>> InOrder(std::span<const Parameter> parameters,
                                            const std::vector<std::string>& names) {
  const std::string all = absl::StrJoin(names, ", ");
  std::vector<double> values(names.size(), 0.0);
  std::vector<bool> is_set(names.size(), false);
  for (const Parameter& parameter : parameters) {
    const auto name = std::find(names.begin(), names.end(), parameter.name);
    if (name == names.end()) {
      return absl::InvalidArgumentError(
          absl::StrCat("'", parameter.name.substr(0, kMaxShownParameter),
                       "' is not a parameter of the family (", all, ")"));
    }
    const auto i = name - names.begin();
    if (is_set[i]) return absl::InvalidArgumentError(absl::StrCat(*name, " is given twice"));
    is_set[i] = true;
    values[i] = parameter.value;
  }
  const auto missing = std::find(is_set.begin(), is_set.end(), false);
  if (missing == is_set.end()) return values;
  return absl::InvalidArgumentError(
      absl::StrCat(names[missing - is_set.begin()], " is missing; there are ", all));
}

}  // namespace

absl::Status CheckWeights(const IndexedFamily& indexed, std::span<const double> weights) {
  return blend::CheckWeights(indexed.family, weights);
}

BlendWeights ClampWeights(const IndexedFamily& indexed, std::vector<double> weights) {
  BlendWeights blend;
  blend.weights = std::move(weights);
  if (CheckWeights(indexed, blend.weights).ok()) {
    blend.is_clamped = indexed.life_limits.Clamp(blend.weights);
  }
  return blend;
}

absl::StatusOr<BlendWeights> WeightsOfPoint(const IndexedFamily& indexed,
                                            std::span<const Parameter> point, bool extrapolate) {
  if (!indexed.parameter_space.has_value()) {
    return absl::FailedPreconditionError(
        absl::StrCat("family ", indexed.family.name,
                     " was registered without points in a parameter space; its frames "
                     "are asked for by weights"));
  }
  const parameters::Interpolator& space = *indexed.parameter_space;
  LB_ASSIGN_OR_RETURN(const std::vector<double> values, InOrder(point, space.names()));
  const auto outside =
      extrapolate ? parameters::Outside::kExtrapolate : parameters::Outside::kRefuse;
  LB_ASSIGN_OR_RETURN(parameters::Location location,
                      space.Locate(values, outside, {kMinWeight, kMaxWeight}));
  const absl::Status limits = CheckWeights(indexed, location.weights);
  if (!limits.ok()) {
    return absl::OutOfRangeError(
        absl::StrCat("are too far outside of the hull: ", std::string(limits.message())));
  }
  BlendWeights blend = ClampWeights(indexed, std::move(location.weights));
  blend.is_extrapolated = location.is_extrapolated;
  return blend;
}

}  // namespace liquidblend::frames
