// Measures how far a registration is from given correspondences.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "liquidblend/v1/liquidblend.pb.h"
#include "server/catalog/families.h"

namespace liquidblend::server {

inline constexpr int kMaxMeasured = 100;

// Checks target and events. Errors: kInvalidArgument, kOutOfRange, with the field at fault.
absl::Status CheckMeasurement(const catalog::LoadedFamily& loaded,
                              const v1::MeasureCorrespondencesRequest& request);

// Measurement of correspondences in short steps, since it may take thousands of slices: two a
// correspondence, of SPACE up to 65. A source's event is carried by the displacement at the nearest
// point of the source's surface at its time.
// Threads: one at a time.  The result is always the same.
class Measurement {
 public:
  // Requires: CheckMeasurement().
  Measurement(catalog::FamilyPtr loaded, v1::MeasureCorrespondencesRequest request);

  // Whether there is no more to measure.
  bool is_over() const { return pair_ == request_.correspondences_size(); }
  // The cost of a step, for FrameQueue.
  int64_t StepCost() const;
  // Makes one slice and measures there.  Requires: !is_over().
  void Step();
  // Requires: is_over().  Errors: kDataLoss if the family's file cannot be read any more.
  absl::StatusOr<v1::MeasureCorrespondencesResponse> TakeResponse();

 private:
  void BeginPair();

  const catalog::FamilyPtr loaded_;
  const v1::MeasureCorrespondencesRequest request_;
  v1::MeasureCorrespondencesResponse response_;
  int pair_ = 0;
  std::vector<double> times_s_;  // of the source, of the pair
  size_t num_measured_ = 0;      // of these
};

}  // namespace liquidblend::server
