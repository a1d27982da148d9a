#include "core/base/host.h"

#include <arpa/inet.h>
#include <netinet/in.h>

#include <string>

#include "absl/strings/match.h"

namespace liquidblend::base {
namespace {

constexpr int kLoopbackNet = 127;

bool IsDigits(absl::string_view text) {
  return text.find_first_not_of("0123456789") == absl::string_view::npos;
}

// Parses an address by inet_pton(). A text that contains a NUL is refused.
bool ParseAddress(int family, absl::string_view text, void* address) {
  return text.find('\0') == absl::string_view::npos &&
         inet_pton(family, std::string(text).c_str(), address) == 1;
}

}  // namespace

std::optional<HostAndPort> SplitHostPort(absl::string_view text) {
  HostAndPort result;
  absl::string_view rest;
  if (absl::StartsWith(text, "[")) {
    const size_t end = text.find(']');
    if (end == absl::string_view::npos) return std::nullopt;
    result.is_bracketed = true;
    result.host = text.substr(1, end - 1);
    rest = text.substr(end + 1);
  } else {
    const size_t colon = text.find(':');
    result.host = text.substr(0, colon);
    if (colon != absl::string_view::npos) rest = text.substr(colon);
    if (result.host.find_first_of("[]") != absl::string_view::npos) return std::nullopt;
  }
  if (result.host.empty()) return std::nullopt;
  if (rest.empty()) return result;
  if (rest[0] != ':' || !IsDigits(rest.substr(1))) return std::nullopt;
  result.port = rest.substr(1);
  return result;
}

bool IsIpAddress(absl::string_view host) {
  in6_addr address;
  return ParseAddress(AF_INET, host, &address) || ParseAddress(AF_INET6, host, &address);
}

bool IsLoopbackHost(absl::string_view host) {
  if (absl::EqualsIgnoreCase(host, "localhost")) return true;
  in_addr v4;
  if (ParseAddress(AF_INET, host, &v4)) return ntohl(v4.s_addr) >> 24 == kLoopbackNet;
  in6_addr v6;
  if (!ParseAddress(AF_INET6, host, &v6)) return false;
  if (IN6_IS_ADDR_V4MAPPED(&v6)) return v6.s6_addr[12] == kLoopbackNet;
  return IN6_IS_ADDR_LOOPBACK(&v6);
}

}  // namespace liquidblend::base
