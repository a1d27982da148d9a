#include "server/frames/query_weights.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/base/status_macros.h"
#include "server/base/errors.h"
#include "server/blend/blend.h"

namespace liquidblend::server {
namespace {

constexpr char kParametersField[] = "parameters";
constexpr size_t kMaxShownParameter = 80;  // of a wrong name, in a message

using Parameters = google::protobuf::RepeatedPtrField<v1::Parameter>;

// The values of the parameters in the order of the names.
absl::StatusOr<std::vector<double>> PointOf(const Parameters& parameters,
                                            const std::vector<std::string>& names) {
  const std::string all = absl::StrJoin(names, ", ");
  std::vector<double> point(names.size(), 0.0);
  std::vector<bool> is_set(names.size(), false);
  for (const v1::Parameter& parameter : parameters) {
    const auto name = std::find(names.begin(), names.end(), parameter.name());
    if (name == names.end()) {
      return InvalidField(kParametersField,
                          absl::StrCat("'", parameter.name().substr(0, kMaxShownParameter),
                                       "' is not a parameter of the family (", all, ")"));
    }
    const auto i = name - names.begin();
    if (is_set[i]) return InvalidField(kParametersField, absl::StrCat(*name, " is given twice"));
    is_set[i] = true;
    point[i] = parameter.value();
  }
  const auto missing = std::find(is_set.begin(), is_set.end(), false);
  if (missing == is_set.end()) return point;
  return InvalidField(kParametersField, absl::StrCat(names[missing - is_set.begin()],
                                                     " is missing; there are ", all));
}

absl::StatusOr<parameters::Location> Locate(const parameters::Interpolator& space,
                                            const std::vector<double>& point, bool extrapolate) {
  const auto outside =
      extrapolate ? parameters::Outside::kExtrapolate : parameters::Outside::kRefuse;
  absl::StatusOr<parameters::Location> location =
      space.Locate(point, outside, {blend::kMinWeight, blend::kMaxWeight});
  if (location.ok()) return location;
  const absl::Status error = AtField(kParametersField, location.status());
  if (extrapolate || !absl::IsOutOfRange(error)) return error;
  return WithReason(error, "OUTSIDE_HULL");
}

// Sets the weights of a point in parameter space.
absl::Status SetWeightsOfPoint(const catalog::LoadedFamily& loaded, const AskedBlend& asked,
                               FrameQuery& query) {
  if (!asked.weights.empty())
    return InvalidField(kParametersField, "exclude weights: give one or the other");
  if (!loaded.parameter_space.has_value()) {
    return AtField(kParametersField,
                   absl::FailedPreconditionError(absl::StrCat(
                       "family ", loaded.family.name,
                       " was registered without points in a parameter space; its frames "
                       "are asked for by weights")));
  }
  const parameters::Interpolator& space = *loaded.parameter_space;
  LB_ASSIGN_OR_RETURN(const std::vector<double> point, PointOf(asked.parameters, space.names()));
  LB_ASSIGN_OR_RETURN(parameters::Location location, Locate(space, point, asked.extrapolate));
  query.weights = std::move(location.weights);
  query.is_extrapolated = location.is_extrapolated;
  const absl::Status limits = blend::CheckWeights(loaded.family, query.weights);
  if (limits.ok()) return limits;
  return AtField(kParametersField,
                 absl::OutOfRangeError(absl::StrCat("are too far outside of the hull: ",
                                                    std::string(limits.message()))));
}

}  // namespace

absl::Status SetWeights(const catalog::LoadedFamily& loaded, const AskedBlend& asked,
                        FrameQuery& query) {
  query.is_extrapolated = query.is_clamped = false;
  query.weights.assign(asked.weights.begin(), asked.weights.end());
  if (!asked.parameters.empty()) LB_RETURN_IF_ERROR(SetWeightsOfPoint(loaded, asked, query));
  if (blend::CheckWeights(loaded.family, query.weights).ok()) {
    query.is_clamped = loaded.life_limits.Clamp(query.weights);
  }
  return absl::OkStatus();
}

}  // namespace liquidblend::server
