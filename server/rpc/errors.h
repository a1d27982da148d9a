// What is wrong with a request, field by field, in the form that clients get it (google.rpc).
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace liquidblend::rpc {

inline constexpr char kBadRequestUrl[] = "type.googleapis.com/google.rpc.BadRequest";
inline constexpr char kErrorInfoUrl[] = "type.googleapis.com/google.rpc.ErrorInfo";

// Collects all that is wrong with a request, so that a client hears of it at once.
class FieldViolations {
 public:
  // `field` as in the proto, e.g. "options.frames_per_second".
  void Add(absl::string_view field, absl::string_view description);
  void AddIf(bool wrong, absl::string_view field, absl::string_view description) {
    if (wrong) Add(field, description);
  }
  // kInvalidArgument with "field: description; ..." and a google.rpc.BadRequest payload; OK if
  // none.
  absl::Status ToStatus() const;

 private:
  std::vector<std::pair<std::string, std::string>> violations_;
};

// One violation.
absl::Status InvalidField(absl::string_view field, absl::string_view description);

// The same error, blamed on a field. OK stays OK.
absl::Status AtField(absl::string_view field, const absl::Status& status);

// Adds google.rpc.ErrorInfo: a reason that programs can rely on (UPPER_SNAKE_CASE).
absl::Status WithReason(absl::Status status, absl::string_view reason);

}  // namespace liquidblend::rpc
