#include "client/src/connection/loopback.h"

#include <arpa/inet.h>
#include <netinet/in.h>

#include <algorithm>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"

namespace liquidblend::client {
namespace {

constexpr int kLoopbackNet = 127;

bool IsLoopbackHost(absl::string_view host) {
  if (absl::EqualsIgnoreCase(host, "localhost")) return true;
  if (host.find('\0') != absl::string_view::npos) return false;
  const std::string text(host);
  in_addr v4;
  if (inet_pton(AF_INET, text.c_str(), &v4) == 1) return ntohl(v4.s_addr) >> 24 == kLoopbackNet;
  in6_addr v6;
  if (inet_pton(AF_INET6, text.c_str(), &v6) != 1) return false;
  if (IN6_IS_ADDR_V4MAPPED(&v6)) return v6.s6_addr[12] == kLoopbackNet;
  return IN6_IS_ADDR_LOOPBACK(&v6);
}

// Nothing, or ":" and digits.
bool IsPort(absl::string_view text) {
  return text.empty() || (text[0] == ':' && text.substr(1).find_first_not_of("0123456789") ==
                                                absl::string_view::npos);
}

using HostTest = absl::FunctionRef<bool(absl::string_view host)>;

// Of HOST, HOST:PORT, [IPv6] or [IPv6]:PORT.
bool HostPasses(absl::string_view address, HostTest test) {
  if (absl::StartsWith(address, "[")) {
    const size_t end = address.find(']');
    return end != absl::string_view::npos && IsPort(address.substr(end + 1)) &&
           test(address.substr(1, end - 1));
  }
  const size_t colon = std::min(address.find(':'), address.size());
  return IsPort(address.substr(colon)) && test(address.substr(0, colon));
}

}  // namespace

bool IsThisMachine(const std::string& target) { return AllHostsPass(target, IsLoopbackHost); }

bool AllHostsPass(const std::string& target, HostTest test) {
  absl::string_view rest = target;
  if (absl::StartsWith(rest, "unix:") || absl::StartsWith(rest, "unix-abstract:")) return true;
  // An authority between the slashes would be a name server, which may say anything.
  if (absl::ConsumePrefix(&rest, "dns:")) {
    if (absl::StartsWith(rest, "//") && !absl::ConsumePrefix(&rest, "///")) return false;
    return HostPasses(rest, test);
  }
  if (absl::ConsumePrefix(&rest, "ipv4:") || absl::ConsumePrefix(&rest, "ipv6:")) {
    absl::ConsumePrefix(&rest, "///");
    const std::vector<absl::string_view> all = absl::StrSplit(rest, ',');
    return std::all_of(all.begin(), all.end(),
                       [&](absl::string_view address) { return HostPasses(address, test); });
  }
  return HostPasses(rest, test);
}

}  // namespace liquidblend::client
