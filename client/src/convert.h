// Messages of the API <-> the plain values of the public headers.
#pragma once

#include "absl/status/statusor.h"
#include "google/longrunning/operations.pb.h"
#include "liquidblend/animation.h"
#include "liquidblend/family.h"
#include "liquidblend/frame.h"
#include "liquidblend/frame_stream.h"
#include "liquidblend/operation.h"
#include "liquidblend/v1/liquidblend.pb.h"

namespace liquidblend::client {

// DATA_LOSS if a rate or a duration is negative or not finite. Of details of errors, the JSON has
// those of the types that our servers send.
absl::StatusOr<Animation> FromProto(const v1::Animation& proto);
// Likewise, and if the points in parameter space are not one of each animation, each of a value per
// name.
absl::StatusOr<Family> FromProto(const v1::Family& proto);
absl::StatusOr<Operation> FromProto(const google::longrunning::Operation& proto);
Frame FromProto(v1::Frame&& proto);

v1::ImportOptions ToProto(const ImportOptions& options);
v1::RegisterFamilyRequest ToProto(const RegisterRequest& request);
v1::GetFrameRequest ToProto(const FrameRequest& request);
v1::StreamFramesRequest ToProto(const StreamSettings& settings);

}  // namespace liquidblend::client
