// The file of `liquidblend register --correspondences` (docs/correspondences.md).
//
// JSON; one list per target, in the order of the --target flags:
//   {"correspondences": [
//     [ {"kind": "point",       // or "trajectory", "space"; default "point"
//        "hard": false,         // default false: held softly, released when the fit is good
//        "source": {"position": [x, y, z], "time_s": t},
//        "target": {"position": [x, y, z], "time_s": t},
//        "length_s": 0.5} ] ]}  // of a trajectory or space; default 0: to the end
// Positions are metres, times seconds since the first frame. Other keys are refused.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "liquidblend/family.h"

namespace liquidblend::cli {

// The kind's name in the file: "point", "trajectory" or "space".
const char* KindName(CorrespondenceKind kind);

// The file's text for a family's correspondences, given and automatic ones: to be edited and read
// again.
std::string FormatCorrespondences(const Family& family);

// Errors: kNotFound; kInvalidArgument, the message names file, target, entry and field.
absl::StatusOr<std::vector<std::vector<Correspondence>>> ReadCorrespondences(
    const std::string& path);

}  // namespace liquidblend::cli
