#include "server/rpc/grpc_status.h"

#include <optional>
#include <string>

#include "absl/strings/cord.h"
#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "server/rpc/errors.h"

namespace liquidblend::rpc {

grpc::Status ToGrpcStatus(const absl::Status& status) {
  if (status.ok()) return grpc::Status::OK;
  const absl::Status told = status.GetPayload(kErrorInfoUrl).has_value()
                                ? status
                                : WithReason(status, absl::StatusCodeToString(status.code()));
  google::rpc::Status details;
  details.set_code(static_cast<int>(told.code()));
  details.set_message(std::string(told.message()));
  for (const char* url : {kBadRequestUrl, kErrorInfoUrl}) {
    const absl::optional<absl::Cord> payload = told.GetPayload(url);
    if (!payload.has_value()) continue;
    google::protobuf::Any* detail = details.add_details();
    detail->set_type_url(url);
    detail->set_value(std::string(*payload));
  }
  return grpc::Status(static_cast<grpc::StatusCode>(told.code()), details.message(),
                      details.SerializeAsString());
}

}  // namespace liquidblend::rpc
