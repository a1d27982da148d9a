// What is wrong with a request, field by field, in the form that clients get it (google.rpc).
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

// Errors travel in HTTP/2 headers, which may hold 8 KiB: no more than this is told of each.
inline constexpr int kMaxViolations = 8;
inline constexpr size_t kMaxErrorText = 240;  // bytes; of a message, description or value

// `text` as valid UTF-8 without control characters ('?' instead), cut to `max_bytes`.
std::string CleanText(absl::string_view text, size_t max_bytes = kMaxErrorText);

// Collects what is wrong with a request, so that a client hears of it at once.
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

// The same error, blamed on a field. OK stays OK.
absl::Status AtField(absl::string_view field, const absl::Status& status);

using ErrorMetadata = std::vector<std::pair<std::string, std::string>>;

// Adds google.rpc.ErrorInfo: a reason that programs can rely on (UPPER_SNAKE_CASE), and what it is
// about.
absl::Status WithReason(absl::Status status, absl::string_view reason,
                        const ErrorMetadata& metadata = {});

// Adds metadata to the status' google.rpc.ErrorInfo, which it gets if it has none (the reason is
// the code's name then). What is there already stays. OK stays OK.
absl::Status WithMetadata(absl::Status status, const ErrorMetadata& metadata);

// Adds google.rpc.QuotaFailure: whose quota it was, and which.
absl::Status WithQuotaFailure(absl::Status status, absl::string_view subject,
                              absl::string_view description);

// Adds google.rpc.RetryInfo: when it makes sense to try again.
absl::Status WithRetryDelay(absl::Status status, absl::Duration delay);

// kInvalidArgument, REQUEST_MALFORMED: what came is no message of the method.
absl::Status MalformedRequest(absl::string_view method);

// The largest request about frames or a call that waits. Real ones take some hundred bytes; a
// parsed message may take 30 times its size in memory, and streams keep theirs.
inline constexpr int64_t kMaxSmallRequestBytes = int64_t{64} << 10;

// kInvalidArgument, REQUEST_TOO_LARGE.
absl::Status RequestTooLarge(absl::string_view method, int64_t size_bytes, int64_t limit_bytes);

// How calls end that a server which stops cannot finish: kUnavailable, SHUTTING_DOWN, try again.
absl::Status ShuttingDown();

}  // namespace liquidblend::server
