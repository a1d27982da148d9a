// Blend of a request (weights or parameters) -> the weights of a query.
#pragma once

#include "absl/status/status.h"
#include "google/protobuf/repeated_field.h"
#include "liquidblend/v1/liquidblend.pb.h"
#include "server/catalog/families.h"
#include "server/frames/make_frame.h"

namespace liquidblend::server {

// Blend of any request for frames: weights, or a point in the family's parameter space.
struct AskedBlend {
  const google::protobuf::RepeatedField<double>& weights;
  const google::protobuf::RepeatedPtrField<v1::Parameter>& parameters;
  bool extrapolate = false;
};

// Sets the query's weights, and whether they are extrapolated.
// Errors, with the field at fault: kInvalidArgument (weights and parameters both; a parameter
// unknown, missing, given twice or not finite), kFailedPrecondition (the family has no parameter
// space), kOutOfRange (outside of the hull, for the reason OUTSIDE_HULL unless extrapolating; or
// extrapolated beyond the range of weights). Weights that are given as such are not checked here.
absl::Status SetWeights(const catalog::LoadedFamily& loaded, const AskedBlend& asked,
                        FrameQuery& query);

}  // namespace liquidblend::server
