// Fields of a query -> the messages that gRPC's clients send. What a field may be is said in
// docs/operations/http.md.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "liquidblend/v1/liquidblend.pb.h"
#include "server/http/query.h"

namespace liquidblend::http {

// Errors: kInvalidArgument with violations that name the query's fields: one that is unknown, or
// whose value cannot be read. Ranges are for the method itself to check.
//   format  of the path's extension
absl::StatusOr<v1::GetFrameRequest> ToGetFrame(const std::string& family_id,
                                               const std::vector<QueryField>& fields,
                                               v1::Encoding::Format format = v1::Encoding::DRACO);
absl::StatusOr<v1::ListFamiliesRequest> ToListFamilies(const std::vector<QueryField>& fields);
absl::StatusOr<v1::GetFamilyRequest> ToGetFamily(const std::string& family_id,
                                                 const std::vector<QueryField>& fields);

}  // namespace liquidblend::http
