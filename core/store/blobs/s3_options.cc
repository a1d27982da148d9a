#include "core/store/blobs/s3_options.h"

#include <cstdlib>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "core/base/retry.h"
#include "core/base/status_macros.h"

namespace liquidblend::store {
namespace {

constexpr int kSlowDownFactor = 4;

std::string FirstOf(const std::string& given, std::initializer_list<const char*> variables,
                    const std::string& fallback = "") {
  if (!given.empty()) return given;
  for (const char* variable : variables) {
    const char* const value = std::getenv(variable);
    if (value != nullptr && *value != '\0') return value;
  }
  return fallback;
}

absl::Status ReadDuration(const char* variable, absl::Duration& value) {
  const std::string text = FirstOf("", {variable});
  if (text.empty() || absl::ParseDuration(text, &value)) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(variable, " is '", text, "', not a duration such as 500ms or 20s"));
}

absl::Status ReadNumber(const char* variable, int64_t& value) {
  const std::string text = FirstOf("", {variable});
  if (text.empty() || absl::SimpleAtoi(text, &value)) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(variable, " is '", text, "', not a number"));
}

}  // namespace

absl::Status S3Options::FillFromEnvironment() {
  region = FirstOf(region, {"AWS_REGION", "AWS_DEFAULT_REGION"}, "us-east-1");
  endpoint = FirstOf(endpoint, {"AWS_ENDPOINT_URL_S3", "AWS_ENDPOINT_URL"},
                     absl::StrCat("https://s3.", region, ".amazonaws.com"));
  ca_file = FirstOf(ca_file, {"AWS_CA_BUNDLE"});
  for (std::string* const url : {&endpoint, &client_endpoint}) {
    while (absl::EndsWith(*url, "/")) url->pop_back();
  }
  LB_RETURN_IF_ERROR(ReadDuration("LIQUIDBLEND_S3_CONNECT_TIMEOUT", connect_timeout));
  LB_RETURN_IF_ERROR(ReadDuration("LIQUIDBLEND_S3_STALL_TIMEOUT", stall_timeout));
  return ReadNumber("LIQUIDBLEND_S3_PART_BYTES", part_bytes);
}

absl::Duration S3Options::PauseAfter(int num_failures, bool is_slow_down) const {
  const absl::Duration first = is_slow_down ? kSlowDownFactor * first_pause : first_pause;
  return base::ExponentialPause(num_failures, first, longest_pause);
}

absl::Status S3Options::Validate() const {
  const auto out_of_range = [](const char* name, const auto& value) {
    return absl::InvalidArgumentError(absl::StrCat(name, " is out of range: ", value));
  };
  const auto duration_out_of_range = [&](const char* name, absl::Duration value) {
    return out_of_range(name, absl::FormatDuration(value));
  };
  if (cache_directory.empty()) return absl::InvalidArgumentError("cache_directory is empty");
  if (cache_bytes < 0) return out_of_range("cache_bytes", cache_bytes);
  if (max_attempts < 1) return out_of_range("max_attempts", max_attempts);
  if (first_pause <= absl::ZeroDuration()) return duration_out_of_range("first_pause", first_pause);
  if (longest_pause < first_pause) return duration_out_of_range("longest_pause", longest_pause);
  if (connect_timeout < absl::Milliseconds(1)) {
    return duration_out_of_range("connect_timeout", connect_timeout);
  }
  if (stall_timeout < connect_timeout) {
    return duration_out_of_range("stall_timeout", stall_timeout);
  }
  if (complete_timeout < absl::ZeroDuration()) {
    return duration_out_of_range("complete_timeout", complete_timeout);
  }
  if (part_bytes < 1024) return out_of_range("part_bytes", part_bytes);
  if (num_parallel < 1 || num_parallel > 64) return out_of_range("num_parallel", num_parallel);
  return absl::OkStatus();
}

}  // namespace liquidblend::store
