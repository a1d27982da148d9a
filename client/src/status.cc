#include "client/src/status.h"

#include <algorithm>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/cord.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/string_view.h"
#include "client/src/reason.h"
#include "google/rpc/error_details.pb.h"

namespace liquidblend::client {
namespace {

// More of a kind are not shown, and what they repeat is looked for in the message's beginning only:
// a server may send millions.
constexpr int kMaxShown = 100;
constexpr size_t kMaxSearchedBytes = 4096;

constexpr char kRetryInfoUrl[] = "type.googleapis.com/google.rpc.RetryInfo";

absl::Duration DelayOf(const google::rpc::RetryInfo& info) {
  return std::max(absl::ZeroDuration(), absl::Seconds(info.retry_delay().seconds()) +
                                            absl::Nanoseconds(info.retry_delay().nanos()));
}

// "" if it says no more than the code and the message.
std::string DescribeErrorInfo(const google::rpc::ErrorInfo& info, int code,
                              absl::string_view message) {
  std::map<std::string, std::string> metadata;
  int num_left = kMaxShown;
  for (const auto& [key, value] : info.metadata()) {
    if (num_left-- == 0) break;
    // "families/drops" is not needed beside "there is no family 'drops'".
    const absl::string_view id = absl::string_view(value).substr(value.rfind('/') + 1);
    if (!absl::StrContains(message, id)) metadata.emplace(key, value);
  }
  const auto code_name = absl::StatusCodeToString(static_cast<absl::StatusCode>(code));
  if (metadata.empty() && info.reason() == code_name) return "";
  std::string text = absl::StrCat("reason: ", info.reason());
  if (!metadata.empty()) {
    absl::StrAppend(&text, " (", absl::StrJoin(metadata, ", ", absl::PairFormatter("=")), ")");
  }
  return text;
}

// Whether `message` is made of sentences of which `text` is one.
bool Says(absl::string_view message, const std::string& text) {
  return absl::StartsWith(message, text) || absl::StrContains(message, "; " + text) ||
         absl::StrContains(message, ": " + text);
}

// Without what the message says already.
std::string DescribeBadRequest(const google::rpc::BadRequest& bad_request,
                               absl::string_view message) {
  std::vector<std::string> violations;
  for (int k = 0; k < std::min(kMaxShown, bad_request.field_violations_size()); ++k) {
    const google::rpc::BadRequest::FieldViolation& violation = bad_request.field_violations(k);
    std::string text = absl::StrCat(violation.field(), ": ", violation.description());
    if (!Says(message, text)) violations.push_back(std::move(text));
  }
  return absl::StrJoin(violations, "; ");
}

std::string DescribeDetail(const google::protobuf::Any& detail, int code,
                           absl::string_view message) {
  google::rpc::ErrorInfo info;
  if (detail.UnpackTo(&info)) return DescribeErrorInfo(info, code, message);
  google::rpc::BadRequest bad_request;
  if (detail.UnpackTo(&bad_request)) return DescribeBadRequest(bad_request, message);
  google::rpc::RetryInfo retry;
  if (detail.UnpackTo(&retry)) {
    // In milliseconds, as nobody reads more.
    const absl::Duration delay = absl::Ceil(DelayOf(retry), absl::Milliseconds(1));
    return absl::StrCat("try again in ", absl::FormatDuration(delay));
  }
  return "";
}

absl::Status MakeStatus(int code, const std::string& message, const google::rpc::Status& details) {
  const absl::string_view beginning = absl::string_view(message).substr(0, kMaxSearchedBytes);
  const int num_details = std::min(kMaxShown, details.details_size());
  std::string text = message;
  for (int k = 0; k < num_details; ++k) {
    const std::string described = DescribeDetail(details.details(k), code, beginning);
    if (!described.empty()) absl::StrAppend(&text, text.empty() ? "" : "; ", described);
  }
  // Google's codes have the same numbers in gRPC, google.rpc and Abseil; others become kUnknown.
  absl::Status status(static_cast<absl::StatusCode>(code >= 0 && code <= 16 ? code : 2), text);
  for (int k = 0; k < num_details; ++k) {
    const google::protobuf::Any& detail = details.details(k);
    if (detail.Is<google::rpc::RetryInfo>()) {
      status.SetPayload(kRetryInfoUrl, absl::Cord(detail.value()));
    }
    google::rpc::ErrorInfo info;
    if (detail.UnpackTo(&info)) SetReason(info.reason(), status);
  }
  return status;
}

}  // namespace

absl::Status FromGrpc(const grpc::Status& status) {
  if (status.ok()) return absl::OkStatus();
  // Our servers' own errors have details. gRPC ends calls like this that are on their way when a
  // server shuts down.
  if (status.error_code() == grpc::StatusCode::CANCELLED && status.error_details().empty()) {
    return absl::UnavailableError("the server has ended the call");
  }
  google::rpc::Status details;
  if (!details.ParseFromString(status.error_details())) details.Clear();
  return MakeStatus(status.error_code(), status.error_message(), details);
}

absl::Status FromProto(const google::rpc::Status& status) {
  return MakeStatus(status.code(), status.message(), status);
}

std::optional<absl::Duration> RetryDelay(const absl::Status& status) {
  if (!absl::IsResourceExhausted(status) && !absl::IsUnavailable(status)) return std::nullopt;
  const absl::optional<absl::Cord> payload = status.GetPayload(kRetryInfoUrl);
  google::rpc::RetryInfo info;
  if (!payload.has_value() || !info.ParseFromString(std::string(*payload))) return std::nullopt;
  return DelayOf(info);
}

}  // namespace liquidblend::client
