// The meta.json beside exported frames, with which `import` reads them as they were
// (docs/formats.md).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "liquidblend/up.h"

namespace liquidblend::cli {

struct ExportMeta {
  double frames_per_second = 0.0;  // > 0
  std::vector<double> times_s;     // of the frames, rising; seconds since the animation's start
  std::string family;
  int64_t version = 0;
  std::vector<double> weights;
  Up up = Up::kUnknown;  // the family's
};

// JSON: fps; frame_times if the frames are not one frame apart; units: metres and metres per
// second; up if it is known; and where the frames are from, under "about". Numbers come back to the
// last bit.
std::string ToMetaJson(const ExportMeta& meta);

}  // namespace liquidblend::cli
