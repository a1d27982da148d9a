// MeasureCorrespondences without a wire.
#pragma once

#include "absl/functional/any_invocable.h"
#include "absl/status/statusor.h"
#include "liquidblend/v1/liquidblend.pb.h"
#include "server/access/principal.h"
#include "server/api/operation_watch.h"
#include "server/frames/backends.h"

namespace liquidblend::server {

// Measures slice by slice, each in a turn of its own on the pool of frames, so that a measurement
// of thousands of slices takes its caller's share of the cores and keeps no thread waiting.
//   is_wanted  asked before each slice; once it says no, the call ends with kCancelled
//   done       called once, on a thread of a pool, or before this returns
// Errors: CheckMeasurement's, FindFamily's, and FramePool::Post's for the first slice.
void MeasureCorrespondences(
    Backends& backends, const v1::MeasureCorrespondencesRequest& request, const Caller& caller,
    IsWanted is_wanted,
    absl::AnyInvocable<void(absl::StatusOr<v1::MeasureCorrespondencesResponse>)> done);

}  // namespace liquidblend::server
