// Encodings of requests as options of the encoder and bits of the family's grid.
#pragma once

#include <string>

#include "core/frames/rounded_surface.h"
#include "liquidblend/v1/liquidblend.pb.h"
#include "server/base/errors.h"
#include "server/encode/draco.h"

namespace liquidblend::server {

inline constexpr int kDefaultPositionBits = 14;  // where an encoding says neither bits nor step

// Checks the encoding and adds its violations.
//   owner  of the grid, for messages: "family splash"
void CheckEncoding(const frames::Grid& grid, const std::string& owner, const v1::Encoding& encoding,
                   FieldViolations& violations);

// The encoder's options for a request's encoding, with defaults filled in, and a step as bits:
// equal options give equal bytes. Requires: CheckEncoding() adds nothing.
encode::DracoOptions DracoOptionsOf(const frames::Grid& grid, const v1::Encoding& encoding);

// The same of the format MESHOPT.
//   duration_s  of the family
frames::RoundingOptions RoundingOptionsOf(const frames::Grid& grid, double duration_s,
                                          const v1::Encoding& encoding);

// Label of an encoding in metrics: "fastest", "balanced" or "smallest" of Draco; "meshopt", "ply",
// "obj".
const char* EncodingLabel(const v1::Encoding& encoding);

}  // namespace liquidblend::server
