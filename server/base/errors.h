// Errors of requests, field by field, with google.rpc details for clients.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"

namespace liquidblend::server {

inline constexpr char kBadRequestUrl[] = "type.googleapis.com/google.rpc.BadRequest";
inline constexpr char kErrorInfoUrl[] = "type.googleapis.com/google.rpc.ErrorInfo";
inline constexpr char kRetryInfoUrl[] = "type.googleapis.com/google.rpc.RetryInfo";
inline constexpr char kQuotaFailureUrl[] = "type.googleapis.com/google.rpc.QuotaFailure";

// Limits of each error, as errors are sent in HTTP/2 headers of at most 8 KiB.
inline constexpr int kMaxViolations = 8;
inline constexpr size_t kMaxErrorText = 240;  // bytes; of a message, description or value

// `text` as valid UTF-8 without control characters ('?' instead), cut to `max_bytes`.
std::string CleanText(absl::string_view text, size_t max_bytes = kMaxErrorText);

// Collects all violations of a request, so that a client gets them together.
class FieldViolations {
 public:
  // `field` as in the proto, e.g. "options.frames_per_second".
  void Add(absl::string_view field, absl::string_view description);
  void AddIf(bool wrong, absl::string_view field, absl::string_view description) {
    if (wrong) Add(field, description);
  }
  // kInvalidArgument with "field: description; ..." and a google.rpc.BadRequest payload of the
  // first kMaxViolations; OK if none.
  absl::Status ToStatus() const;

 private:
  std::vector<std::pair<std::string, std::string>> violations_;  // the first kMaxViolations
  int num_violations_ = 0;
};

// One violation.
absl::Status InvalidField(absl::string_view field, absl::string_view description);

// The same error as a violation of a field. OK stays OK.
absl::Status AtField(absl::string_view field, const absl::Status& status);

using ErrorMetadata = std::vector<std::pair<std::string, std::string>>;

// Adds google.rpc.ErrorInfo: a stable reason for programs (UPPER_SNAKE_CASE), and metadata.
absl::Status WithReason(absl::Status status, absl::string_view reason,
                        const ErrorMetadata& metadata = {});

// Adds metadata to the status' google.rpc.ErrorInfo, which is added if missing (with the code's
// name as reason). Existing metadata stay. OK stays OK.
absl::Status WithMetadata(absl::Status status, const ErrorMetadata& metadata);

// Adds google.rpc.QuotaFailure: whose quota it was, and which.
absl::Status WithQuotaFailure(absl::Status status, absl::string_view subject,
                              absl::string_view description);

// The reason of google.rpc.ErrorInfo; empty if there is none.
std::string ReasonOf(const absl::Status& status);

// Adds google.rpc.RetryInfo: the delay before a new attempt.
absl::Status WithRetryDelay(absl::Status status, absl::Duration delay);

// kInvalidArgument, REQUEST_MALFORMED: the bytes do not parse as a message of the method.
absl::Status MalformedRequest(absl::string_view method);

// The largest request about frames or a call that waits. Real ones take some hundred bytes; a
// parsed message may take 30 times its size in memory, and streams keep theirs.
inline constexpr int64_t kMaxSmallRequestBytes = int64_t{64} << 10;

// kInvalidArgument, REQUEST_TOO_LARGE.
absl::Status RequestTooLarge(absl::string_view method, int64_t size_bytes, int64_t limit_bytes);

// Status of calls that a stopping server cannot finish: kUnavailable, SHUTTING_DOWN, with a delay
// before a new attempt.
absl::Status ShuttingDown();

// kUnavailable, TOO_MANY_ANSWERS, with a delay before a new attempt: clients have not read so many
// bytes of answers that there is no memory for another one.
absl::Status TooManyAnswers();

}  // namespace liquidblend::server
