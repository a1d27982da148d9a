#include "server/base/errors.h"

#include "absl/strings/cord.h"
#include "absl/strings/str_cat.h"
#include "google/rpc/error_details.pb.h"

namespace liquidblend::server {
namespace {

constexpr absl::Duration kAnswersDelay = absl::Seconds(1);
constexpr absl::Duration kRestartDelay = absl::Seconds(1);  // after which another server may answer

// Length of the UTF-8 sequence that `text` begins with; 0 if it is none. Overlong forms of two
// bytes, surrogates and numbers past Unicode's end are left out by the second byte's range.
size_t SequenceLength(absl::string_view text) {
  const auto byte = [&](size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char first = byte(0);
  const size_t length = first < 0x80 ? 1 : first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
  if (length == 1) return first < 0x20 || first == 0x7F ? 0 : 1;
  if (first < 0xC2 || first > 0xF4 || text.size() < length) return 0;
  for (size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0) != 0x80) return 0;
  }
  const bool is_bad = (first == 0xE0 && byte(1) < 0xA0) || (first == 0xED && byte(1) > 0x9F) ||
                      (first == 0xF0 && byte(1) < 0x90) || (first == 0xF4 && byte(1) > 0x8F);
  return is_bad ? 0 : length;
}

google::rpc::ErrorInfo InfoOf(const absl::Status& status) {
  google::rpc::ErrorInfo info;
  const absl::optional<absl::Cord> payload = status.GetPayload(kErrorInfoUrl);
  if (payload.has_value() && info.ParseFromString(std::string(*payload))) return info;
  info.set_reason(absl::StatusCodeToString(status.code()));
  info.set_domain("liquidblend");
  return info;
}

void SetInfo(const google::rpc::ErrorInfo& info, absl::Status& status) {
  status.SetPayload(kErrorInfoUrl, absl::Cord(info.SerializeAsString()));
}

void AddMetadata(const ErrorMetadata& metadata, google::rpc::ErrorInfo& info) {
  for (const auto& [key, value] : metadata)
    info.mutable_metadata()->insert({key, CleanText(value)});
}

}  // namespace

std::string CleanText(absl::string_view text, size_t max_bytes) {
  std::string clean;
  while (!text.empty()) {
    const size_t length = SequenceLength(text);
    const size_t num_bytes = std::max<size_t>(length, 1);
    if (clean.size() + num_bytes > max_bytes) return clean;
    absl::StrAppend(&clean, length == 0 ? "?" : text.substr(0, length));
    text.remove_prefix(num_bytes);
  }
  return clean;
}

void FieldViolations::Add(absl::string_view field, absl::string_view description) {
  if (++num_violations_ > kMaxViolations) return;
  violations_.emplace_back(CleanText(field), CleanText(description));
}

absl::Status FieldViolations::ToStatus() const {
  if (violations_.empty()) return absl::OkStatus();
  std::string message;
  google::rpc::BadRequest details;
  for (const auto& [field, description] : violations_) {
    absl::StrAppend(&message, message.empty() ? "" : "; ", field, ": ", description);
    google::rpc::BadRequest::FieldViolation* violation = details.add_field_violations();
    violation->set_field(field);
    violation->set_description(description);
  }
  if (num_violations_ > kMaxViolations) {
    absl::StrAppend(&message, "; and ", num_violations_ - kMaxViolations, " more");
  }
  absl::Status status = absl::InvalidArgumentError(message);
  status.SetPayload(kBadRequestUrl, absl::Cord(details.SerializeAsString()));
  return status;
}

absl::Status InvalidField(absl::string_view field, absl::string_view description) {
  FieldViolations violations;
  violations.Add(field, description);
  return violations.ToStatus();
}

absl::Status AtField(absl::string_view field, const absl::Status& status) {
  if (status.ok()) return status;
  google::rpc::BadRequest details;
  google::rpc::BadRequest::FieldViolation* violation = details.add_field_violations();
  violation->set_field(std::string(field));
  violation->set_description(CleanText(status.message()));
  absl::Status blamed(status.code(), absl::StrCat(field, ": ", status.message()));
  blamed.SetPayload(kBadRequestUrl, absl::Cord(details.SerializeAsString()));
  return blamed;
}

absl::Status WithReason(absl::Status status, absl::string_view reason,
                        const ErrorMetadata& metadata) {
  google::rpc::ErrorInfo info;
  info.set_reason(std::string(reason));
  info.set_domain("liquidblend");
  AddMetadata(metadata, info);
  SetInfo(info, status);
  return status;
}

absl::Status WithMetadata(absl::Status status, const ErrorMetadata& metadata) {
  if (status.ok()) return status;
  google::rpc::ErrorInfo info = InfoOf(status);
  AddMetadata(metadata, info);
  SetInfo(info, status);
  return status;
}

absl::Status WithQuotaFailure(absl::Status status, absl::string_view subject,
                              absl::string_view description) {
  google::rpc::QuotaFailure failure;
  google::rpc::QuotaFailure::Violation* const violation = failure.add_violations();
  violation->set_subject(CleanText(subject));
  violation->set_description(CleanText(description));
  status.SetPayload(kQuotaFailureUrl, absl::Cord(failure.SerializeAsString()));
  return status;
}

std::string ReasonOf(const absl::Status& status) { return InfoOf(status).reason(); }

absl::Status WithRetryDelay(absl::Status status, absl::Duration delay) {
  google::rpc::RetryInfo info;
  const int64_t nanoseconds = absl::ToInt64Nanoseconds(delay);
  info.mutable_retry_delay()->set_seconds(nanoseconds / 1'000'000'000);
  info.mutable_retry_delay()->set_nanos(static_cast<int32_t>(nanoseconds % 1'000'000'000));
  status.SetPayload(kRetryInfoUrl, absl::Cord(info.SerializeAsString()));
  return status;
}

absl::Status MalformedRequest(absl::string_view method) {
  return WithReason(absl::InvalidArgumentError(
                        "the request does not parse as a message of the method, or is not UTF-8"),
                    "REQUEST_MALFORMED", {{"method", std::string(method)}});
}

absl::Status RequestTooLarge(absl::string_view method, int64_t size_bytes, int64_t limit_bytes) {
  return WithReason(absl::InvalidArgumentError(absl::StrCat("the request has ", size_bytes,
                                                            " bytes, more than the ", limit_bytes,
                                                            " that this method takes")),
                    "REQUEST_TOO_LARGE",
                    {{"method", std::string(method)}, {"limit", absl::StrCat(limit_bytes)}});
}

absl::Status ShuttingDown() {
  return WithRetryDelay(
      WithReason(absl::UnavailableError("the server is shutting down"), "SHUTTING_DOWN"),
      kRestartDelay);
}

absl::Status TooManyAnswers() {
  return WithRetryDelay(
      WithReason(absl::UnavailableError("too many answers wait for their clients"),
                 "TOO_MANY_ANSWERS"),
      kAnswersDelay);
}

}  // namespace liquidblend::server
