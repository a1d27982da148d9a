#include "client/src/status.h"

#include <map>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "google/rpc/error_details.pb.h"

namespace liquidblend::client {
namespace {

// "" if it says no more than the code.
std::string DescribeErrorInfo(const google::rpc::ErrorInfo& info, int code) {
  const std::map<std::string, std::string> metadata(info.metadata().begin(), info.metadata().end());
  const auto code_name = absl::StatusCodeToString(static_cast<absl::StatusCode>(code));
  if (metadata.empty() && info.reason() == code_name) return "";
  std::string text = absl::StrCat("reason: ", info.reason());
  if (!metadata.empty()) {
    absl::StrAppend(&text, " (", absl::StrJoin(metadata, ", ", absl::PairFormatter("=")), ")");
  }
  return text;
}

std::string DescribeBadRequest(const google::rpc::BadRequest& bad_request) {
  return absl::StrJoin(bad_request.field_violations(), "; ",
                       [](std::string* out, const auto& violation) {
                         absl::StrAppend(out, violation.field(), ": ", violation.description());
                       });
}

std::string DescribeDetail(const google::protobuf::Any& detail, int code) {
  google::rpc::ErrorInfo info;
  if (detail.UnpackTo(&info)) return DescribeErrorInfo(info, code);
  google::rpc::BadRequest bad_request;
  if (detail.UnpackTo(&bad_request)) return DescribeBadRequest(bad_request);
  return "";
}

absl::Status MakeStatus(int code, const std::string& message, const google::rpc::Status& details) {
  std::string text = message;
  for (const google::protobuf::Any& detail : details.details()) {
    const std::string described = DescribeDetail(detail, code);
    if (!described.empty()) absl::StrAppend(&text, text.empty() ? "" : "; ", described);
  }
  // Google's codes have the same numbers in gRPC, google.rpc and Abseil; others become kUnknown.
  return absl::Status(static_cast<absl::StatusCode>(code >= 0 && code <= 16 ? code : 2), text);
}

}  // namespace

absl::Status FromGrpc(const grpc::Status& status) {
  if (status.ok()) return absl::OkStatus();
  google::rpc::Status details;
  if (!details.ParseFromString(status.error_details())) details.Clear();
  return MakeStatus(status.error_code(), status.error_message(), details);
}

absl::Status FromProto(const google::rpc::Status& status) {
  return MakeStatus(status.code(), status.message(), status);
}

}  // namespace liquidblend::client
