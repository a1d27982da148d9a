// Fields of a query -> the request messages of the API. docs/operations/http.md lists the fields.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "liquidblend/v1/liquidblend.pb.h"
#include "server/http/query.h"

namespace liquidblend::http {

// Errors: kInvalidArgument with violations that name the query's fields: an unknown one, or one
// whose value cannot be read. Ranges are checked by the method.
//   format  of the path's extension
absl::StatusOr<v1::GetFrameRequest> ToGetFrame(const std::string& family_id,
                                               const std::vector<QueryField>& fields,
                                               v1::Encoding::Format format = v1::Encoding::DRACO);
absl::StatusOr<v1::ListFamiliesRequest> ToListFamilies(const std::vector<QueryField>& fields);
absl::StatusOr<v1::GetFamilyRequest> ToGetFamily(const std::string& family_id,
                                                 const std::vector<QueryField>& fields);

}  // namespace liquidblend::http
