// A frame of an animation as it was imported -> its bytes for a client.
#pragma once

#include "absl/status/statusor.h"
#include "core/store/files/files.h"
#include "liquidblend/v1/liquidblend.pb.h"

namespace liquidblend::server {

inline constexpr int kMaxAnimationLevel = 8;

// The frame that the request means, from 0 on.
// Errors: kInvalidArgument, kOutOfRange, with the field at fault.
absl::StatusOr<int> FindAnimationFrame(const store::v1::AnimationManifest& manifest,
                                       const v1::GetAnimationFrameRequest& request);

// Checks level, encoding and attributes of the request. Errors: kInvalidArgument with the fields.
absl::Status CheckAnimationFrame(const store::v1::AnimationManifest& manifest,
                                 const v1::GetAnimationFrameRequest& request);

// Cost of the frame, for FrameQueue: as of slices of as many triangles.
int64_t CostOfAnimationFrame(const mesh::TriangleMesh& frame);

// Simplifies, finishes and encodes frame k.
// Requires: both checks.  Errors: kInvalidArgument if velocities are asked for that are not there.
// Threads: safe, same bytes always.  Cost: as MakeFrame()'s last stages.
absl::StatusOr<v1::AnimationFrame> EncodeAnimationFrame(
    const store::v1::AnimationManifest& manifest, int k, mesh::TriangleMesh frame,
    const v1::GetAnimationFrameRequest& request);

}  // namespace liquidblend::server
