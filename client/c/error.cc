#include "client/c/error.h"

#include <array>

#include "absl/strings/str_cat.h"

namespace liquidblend::c_api {
namespace {

constexpr std::array<const char*, 17> kNames = {
    "OK",        "CANCELLED",      "UNKNOWN",           "INVALID_ARGUMENT",   "DEADLINE_EXCEEDED",
    "NOT_FOUND", "ALREADY_EXISTS", "PERMISSION_DENIED", "RESOURCE_EXHAUSTED", "FAILED_PRECONDITION",
    "ABORTED",   "OUT_OF_RANGE",   "UNIMPLEMENTED",     "INTERNAL",           "UNAVAILABLE",
    "DATA_LOSS", "UNAUTHENTICATED"};

std::string& LastError() {
  thread_local std::string text;
  return text;
}

}  // namespace

lb_status Report(const absl::Status& status) {
  if (!status.ok()) LastError() = std::string(status.message());
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

const char* lb_last_error(void) { return liquidblend::c_api::LastError().c_str(); }

}  // extern "C"
