#include "client/c/error.h"

#include <array>

#include "absl/strings/str_cat.h"
#include "client/src/reason.h"

namespace liquidblend::c_api {
namespace {

constexpr std::array<const char*, 17> kNames = {
    "OK",        "CANCELLED",      "UNKNOWN",           "INVALID_ARGUMENT",   "DEADLINE_EXCEEDED",
    "NOT_FOUND", "ALREADY_EXISTS", "PERMISSION_DENIED", "RESOURCE_EXHAUSTED", "FAILED_PRECONDITION",
    "ABORTED",   "OUT_OF_RANGE",   "UNIMPLEMENTED",     "INTERNAL",           "UNAVAILABLE",
    "DATA_LOSS", "UNAUTHENTICATED"};

struct Failure {
  std::string message, reason;
};

Failure& LastFailure() {
  thread_local Failure failure;
  return failure;
}

}  // namespace

lb_status Report(const absl::Status& status) {
  if (!status.ok()) LastFailure() = {std::string(status.message()), client::ReasonOf(status)};
  return static_cast<lb_status>(status.code());
}

absl::Status InvalidArgument(const char* argument, const char* what) {
  return absl::InvalidArgumentError(absl::StrCat(argument, " ", what));
}

}  // namespace liquidblend::c_api

extern "C" {

const char* lb_status_name(lb_status status) {
  const auto code = static_cast<size_t>(status);
  const auto& names = liquidblend::c_api::kNames;
  return code < names.size() ? names[code] : "UNKNOWN";
}

const char* lb_last_error(void) { return liquidblend::c_api::LastFailure().message.c_str(); }

const char* lb_last_error_reason(void) { return liquidblend::c_api::LastFailure().reason.c_str(); }

}  // extern "C"
