// Encodings of requests as options of the encoder and bits of the family's grid.
#pragma once

#include <string>

#include "liquidblend/v1/liquidblend.pb.h"
#include "server/base/errors.h"
#include "server/encode/draco.h"

namespace liquidblend::server {

inline constexpr int kDefaultPositionBits = 14;  // where an encoding says neither bits nor step

// Checks the encoding and adds its violations.
//   owner  of the grid, for messages: "family splash"
void CheckEncoding(const encode::Grid& grid, const std::string& owner, const v1::Encoding& encoding,
                   FieldViolations& violations);

// The encoder's options for a request's encoding, with defaults filled in, and a step as bits:
// equal options give equal bytes. Requires: CheckEncoding() adds nothing.
encode::DracoOptions DracoOptionsOf(const encode::Grid& grid, const v1::Encoding& encoding);

// Label of an encoding in metrics: "fastest", "balanced" or "smallest" of Draco; "ply", "obj".
const char* EncodingLabel(const v1::Encoding& encoding);

}  // namespace liquidblend::server
