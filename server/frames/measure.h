// Measures how far a registration is from given correspondences.
#pragma once

#include "absl/status/statusor.h"
#include "liquidblend/v1/liquidblend.pb.h"
#include "server/catalog/families.h"

namespace liquidblend::server {

inline constexpr int kMaxMeasured = 100;

// Checks target and events. Errors: kInvalidArgument, kOutOfRange, with the field at fault.
absl::Status CheckMeasurement(const catalog::LoadedFamily& loaded,
                              const v1::MeasureCorrespondencesRequest& request);

// Cost of the measurement, for FrameQueue.
int64_t CostOfMeasurement(const catalog::LoadedFamily& loaded,
                          const v1::MeasureCorrespondencesRequest& request);

// A source's event is carried by the displacement at the nearest point of the source's surface at
// its time.
// Requires: CheckMeasurement().  Errors: kDataLoss if the family's file cannot be read any more.
// Threads: safe, same result always.  Cost: two slices a correspondence, of SPACE one a frame.
absl::StatusOr<v1::MeasureCorrespondencesResponse> Measure(
    const catalog::LoadedFamily& loaded, const v1::MeasureCorrespondencesRequest& request);

}  // namespace liquidblend::server
