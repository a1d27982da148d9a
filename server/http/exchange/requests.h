// Fields of a frame's query -> the request message, with names shorter than the API's.
// docs/operations/http.md lists them.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "liquidblend/v1/liquidblend.pb.h"
#include "server/transcode/query.h"

namespace liquidblend::http {

// Errors: kInvalidArgument with violations that name the query's fields: an unknown one, or one
// whose value cannot be read. Ranges are checked by the method.
//   format  of the path's extension
absl::StatusOr<v1::GetFrameRequest> ToGetFrame(const std::string& family_id,
                                               const std::vector<transcode::QueryField>& fields,
                                               v1::Encoding::Format format = v1::Encoding::DRACO);

}  // namespace liquidblend::http
