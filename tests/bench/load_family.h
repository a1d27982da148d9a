// A synthetic family in a data directory, for load tests.
#pragma once

#include <cstdlib>
#include <string>
#include <utility>

#include "absl/status/statusor.h"

namespace liquidblend::bench {

inline constexpr char kLoadFamily[] = "load";  // its id

// Aborts with a message.
void Require(const absl::Status& status);
template <typename T>
T Require(absl::StatusOr<T> result) {
  Require(result.status());
  return *std::move(result);
}

// A growing torus of quads with one target, as if workers had registered it. At weight 1 events are
// shifted by up to warp_frames, so that frames have more vertices than the source's:
// vertices_per_frame on average over weights in [0, 1] and times. Returns how many the source's
// have. Aborts if it cannot be made.
int MakeLoadFamily(const std::string& data_directory, int vertices_per_frame, double warp_frames);

}  // namespace liquidblend::bench
