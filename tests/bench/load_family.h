// A synthetic family in a data directory, for load tests.
#pragma once

#include <string>

#include "absl/status/statusor.h"

namespace liquidblend::bench {

inline constexpr char kLoadFamily[] = "load";  // its id

// A growing torus of quads with one target, as if workers had registered it. At weight 1 events are
// shifted by up to warp_frames, so that frames have more vertices than the source's:
// vertices_per_frame on average over weights in [0, 1] and times. Returns how many the source's
// have. Errors: the store's.
absl::StatusOr<int> MakeLoadFamily(const std::string& data_directory, int vertices_per_frame,
                                   double warp_frames);

}  // namespace liquidblend::bench
