#include "server/frames/query_weights.h"

#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "core/frames/blend_weights.h"
#include "server/base/errors.h"

namespace liquidblend::server {
namespace {

constexpr char kParametersField[] = "parameters";

std::vector<frames::Parameter> PointOf(
    const google::protobuf::RepeatedPtrField<v1::Parameter>& parameters) {
  std::vector<frames::Parameter> point;
  for (const v1::Parameter& parameter : parameters) {
    point.push_back({parameter.name(), parameter.value()});
  }
  return point;
}

absl::StatusOr<frames::BlendWeights> WeightsOfPoint(const catalog::LoadedFamily& loaded,
                                                    const AskedBlend& asked) {
  if (!asked.weights.empty())
    return InvalidField(kParametersField, "exclude weights: give one or the other");
  auto blend = frames::WeightsOfPoint(loaded, PointOf(asked.parameters), asked.extrapolate);
  if (blend.ok()) return blend;
  const absl::Status error = AtField(kParametersField, blend.status());
  if (asked.extrapolate || !absl::IsOutOfRange(error)) return error;
  return WithReason(error, "OUTSIDE_HULL");
}

}  // namespace

absl::Status SetWeights(const catalog::LoadedFamily& loaded, const AskedBlend& asked,
                        FrameQuery& query) {
  frames::BlendWeights blend;
  if (asked.parameters.empty()) {
    blend = frames::ClampWeights(loaded, {asked.weights.begin(), asked.weights.end()});
  } else {
    LB_ASSIGN_OR_RETURN(blend, WeightsOfPoint(loaded, asked));
  }
  query.weights = std::move(blend.weights);
  query.is_extrapolated = blend.is_extrapolated;
  query.is_clamped = blend.is_clamped;
  return absl::OkStatus();
}

}  // namespace liquidblend::server
