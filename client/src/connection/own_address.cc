#include "client/src/connection/own_address.h"

#include <arpa/inet.h>
#include <curl/curl.h>
#include <ifaddrs.h>
#include <netdb.h>
#include <netinet/in.h>

#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>

namespace liquidblend::client {
namespace {

constexpr char kProxyPort[] = "1080";  // curl's, of a proxy whose port is not said

// An IPv4 address in network order, or mapped into IPv6, as IPv6. Returns false for other families.
bool ToV6(const sockaddr& address, in6_addr& v6) {
  const char* const bytes = reinterpret_cast<const char*>(&address);
  if (address.sa_family == AF_INET6) {
    std::memcpy(&v6, bytes + offsetof(sockaddr_in6, sin6_addr), sizeof(v6));
    return true;
  }
  if (address.sa_family != AF_INET) return false;
  v6 = in6_addr{};
  v6.s6_addr[10] = v6.s6_addr[11] = 0xFF;
  std::memcpy(&v6.s6_addr[12], bytes + offsetof(sockaddr_in, sin_addr), sizeof(in_addr));
  return true;
}

bool HasSameHost(const sockaddr& a, const sockaddr& b) {
  in6_addr host_a, host_b;
  return ToV6(a, host_a) && ToV6(b, host_b) && IN6_ARE_ADDR_EQUAL(&host_a, &host_b);
}

in_port_t PortOf(const sockaddr& address) {
  static_assert(offsetof(sockaddr_in, sin_port) == offsetof(sockaddr_in6, sin6_port));
  in_port_t port;
  std::memcpy(&port, reinterpret_cast<const char*>(&address) + offsetof(sockaddr_in, sin_port),
              sizeof(port));
  return port;
}

bool IsLoopbackOrLinkLocal(const in6_addr& v6) {
  if (IN6_IS_ADDR_V4MAPPED(&v6)) {
    const uint8_t* const v4 = &v6.s6_addr[12];
    return v4[0] == 127 || v4[0] == 0 || (v4[0] == 169 && v4[1] == 254);
  }
  return IN6_IS_ADDR_LOOPBACK(&v6) || IN6_IS_ADDR_UNSPECIFIED(&v6) || IN6_IS_ADDR_LINKLOCAL(&v6);
}

bool IsOfAnInterface(const sockaddr& address) {
  ifaddrs* first = nullptr;
  if (getifaddrs(&first) != 0) return false;
  const std::unique_ptr<ifaddrs, decltype(&freeifaddrs)> owner(first, freeifaddrs);
  for (const ifaddrs* next = first; next != nullptr; next = next->ifa_next) {
    if (next->ifa_addr != nullptr && HasSameHost(*next->ifa_addr, address)) return true;
  }
  return false;
}

// A part of a url; "" if it has none.
std::string PartOf(CURLU* url, CURLUPart part) {
  char* text = nullptr;
  const bool is_there = curl_url_get(url, part, &text, 0) == CURLUE_OK;
  std::string copy = is_there ? text : "";
  curl_free(text);
  return copy;
}

// Whether one of the addresses of `proxy`, such as "http://proxy:3128" or "proxy:3128", is this.
bool IsProxy(const char* proxy, const sockaddr& address) {
  const std::unique_ptr<CURLU, decltype(&curl_url_cleanup)> url(curl_url(), curl_url_cleanup);
  const unsigned int flags = CURLU_GUESS_SCHEME | CURLU_NON_SUPPORT_SCHEME;
  if (curl_url_set(url.get(), CURLUPART_URL, proxy, flags) != CURLUE_OK) return false;
  std::string host = PartOf(url.get(), CURLUPART_HOST);
  if (!host.empty() && host.front() == '[') host = host.substr(1, host.size() - 2);
  const std::string port = PartOf(url.get(), CURLUPART_PORT);
  addrinfo* first = nullptr;
  addrinfo hints = {};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_NUMERICSERV;
  if (getaddrinfo(host.c_str(), port.empty() ? kProxyPort : port.c_str(), &hints, &first) != 0) {
    return false;
  }
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> owner(first, freeaddrinfo);
  for (const addrinfo* next = first; next != nullptr; next = next->ai_next) {
    if (HasSameHost(*next->ai_addr, address) && PortOf(*next->ai_addr) == PortOf(address)) {
      return true;
    }
  }
  return false;
}

}  // namespace

bool IsOwnOrLinkLocal(const sockaddr& address) {
  in6_addr v6;
  return !ToV6(address, v6) || IsLoopbackOrLinkLocal(v6) || IsOfAnInterface(address);
}

bool IsOwnHost(absl::string_view host) {
  if (host.find('\0') != absl::string_view::npos) return false;
  const std::string text(host);
  sockaddr_in v4 = {};
  v4.sin_family = AF_INET;
  if (inet_pton(AF_INET, text.c_str(), &v4.sin_addr) == 1) {
    return IsOfAnInterface(reinterpret_cast<const sockaddr&>(v4));
  }
  sockaddr_in6 v6 = {};
  v6.sin6_family = AF_INET6;
  return inet_pton(AF_INET6, text.c_str(), &v6.sin6_addr) == 1 &&
         IsOfAnInterface(reinterpret_cast<const sockaddr&>(v6));
}

bool IsProxyOfEnvironment(const sockaddr& address) {
  for (const char* name : {"http_proxy", "https_proxy", "HTTPS_PROXY", "all_proxy", "ALL_PROXY"}) {
    const char* const proxy = std::getenv(name);
    if (proxy != nullptr && *proxy != '\0' && IsProxy(proxy, address)) return true;
  }
  return false;
}

}  // namespace liquidblend::client
