#include <algorithm>

#include "absl/strings/str_cat.h"
#include "server/http/exchange/host.h"
#include "server/http/port.h"

namespace liquidblend::http {
namespace {

absl::Status OutOfRange(absl::string_view field, absl::string_view value) {
  return absl::InvalidArgumentError(
      absl::StrCat("http option ", field, " is out of range: ", value));
}

bool IsOrigin(const std::string& text) {
  if (text.empty() || text == "*") return true;
  const size_t slashes = text.find("://");
  return slashes != std::string::npos && slashes > 0 && slashes + 3 < text.size() &&
         text.find('/', slashes + 3) == std::string::npos &&
         std::all_of(text.begin(), text.end(), [](char c) { return c > ' ' && c <= '~'; });
}

}  // namespace

absl::Status PortOptions::Validate() const {
  if (listen.rfind(':') == std::string::npos) return OutOfRange("listen", listen);
  if (!IsOrigin(router.allowed_origin)) return OutOfRange("allowed_origin", router.allowed_origin);
  for (const std::string& name : router.hosts) {
    if (!IsHostName(name)) return OutOfRange("hosts", name);
  }
  if (num_threads < 1) return OutOfRange("num_threads", absl::StrCat(num_threads));
  if (max_connections < 1) return OutOfRange("max_connections", absl::StrCat(max_connections));
  if (max_header_bytes < 256 || max_header_bytes > 1 << 20) {
    return OutOfRange("max_header_bytes", absl::StrCat(max_header_bytes));
  }
  if (max_message_bytes < 256 || max_message_bytes > 64 << 20) {
    return OutOfRange("max_message_bytes", absl::StrCat(max_message_bytes));
  }
  if (router.max_body_bytes < 1) {
    return OutOfRange("max_body_bytes", absl::StrCat(router.max_body_bytes));
  }
  if (router.max_bodies_bytes < 1) {
    return OutOfRange("max_bodies_bytes", absl::StrCat(router.max_bodies_bytes));
  }
  if (router.max_answers_bytes < 1) {
    return OutOfRange("max_answers_bytes", absl::StrCat(router.max_answers_bytes));
  }
  if (idle_timeout <= absl::ZeroDuration()) {
    return OutOfRange("idle_timeout", absl::FormatDuration(idle_timeout));
  }
  if (write_timeout <= absl::ZeroDuration()) {
    return OutOfRange("write_timeout", absl::FormatDuration(write_timeout));
  }
  if (close_timeout <= absl::ZeroDuration()) {
    return OutOfRange("close_timeout", absl::FormatDuration(close_timeout));
  }
  return absl::OkStatus();
}

}  // namespace liquidblend::http
