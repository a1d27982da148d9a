#include "client/src/connection/own_address.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <ifaddrs.h>
#include <netdb.h>
#include <netinet/in.h>

#include <cstdlib>
#include <string>

#include "absl/strings/str_cat.h"
#include "client/src/direct_files.h"
#include "tests/client/src/connection/without_proxies.h"

namespace liquidblend::client {
namespace {

// What is asked of an address given as text.
template <typename Question>
bool Ask(const Question& question, const std::string& host, const char* port = "80") {
  addrinfo hints = {}, *found = nullptr;
  hints.ai_flags = AI_NUMERICHOST | AI_NUMERICSERV;
  hints.ai_socktype = SOCK_STREAM;
  EXPECT_EQ(getaddrinfo(host.c_str(), port, &hints, &found), 0) << host;
  if (found == nullptr) return false;
  const bool answer = question(*found->ai_addr);
  freeaddrinfo(found);
  return answer;
}

TEST(IsOwnOrLinkLocal, OfLoopbackUnspecifiedAndLinkLocalAddresses) {
  for (const char* host : {"127.0.0.1", "127.1.2.3", "0.0.0.0", "169.254.169.254", "::1",
                           "::", "::ffff:127.0.0.1", "::ffff:169.254.1.1", "fe80::1"}) {
    EXPECT_TRUE(Ask(IsOwnOrLinkLocal, host)) << host;
  }
  for (const char* host : {"192.0.2.1", "128.0.0.1", "169.253.1.1", "2001:db8::1",
                           "::ffff:192.0.2.1", "64:ff9b::7f00:1"}) {
    EXPECT_FALSE(Ask(IsOwnOrLinkLocal, host)) << host;
  }
  sockaddr local = {};
  local.sa_family = AF_UNIX;
  EXPECT_TRUE(IsOwnOrLinkLocal(local));
}

TEST(IsOwnOrLinkLocal, OfEachInterface) {
  ifaddrs* first = nullptr;
  ASSERT_EQ(getifaddrs(&first), 0);
  for (const ifaddrs* next = first; next != nullptr; next = next->ifa_next) {
    if (next->ifa_addr == nullptr) continue;
    const int family = next->ifa_addr->sa_family;
    if (family != AF_INET && family != AF_INET6) continue;
    EXPECT_TRUE(IsOwnOrLinkLocal(*next->ifa_addr)) << next->ifa_name;
  }
  freeifaddrs(first);
}

TEST(IsOwnHost, OfEachInterfaceAsText) {
  ifaddrs* first = nullptr;
  ASSERT_EQ(getifaddrs(&first), 0);
  for (const ifaddrs* next = first; next != nullptr; next = next->ifa_next) {
    if (next->ifa_addr == nullptr || next->ifa_addr->sa_family != AF_INET) continue;
    char text[INET_ADDRSTRLEN];
    const auto& address = reinterpret_cast<const sockaddr_in&>(*next->ifa_addr);
    ASSERT_NE(inet_ntop(AF_INET, &address.sin_addr, text, sizeof(text)), nullptr);
    EXPECT_TRUE(IsOwnHost(text)) << text;
    EXPECT_EQ(HostsOf(absl::StrCat(text, ":50051")), HttpHosts::kAny);
  }
  freeifaddrs(first);
  for (const char* host : {"192.0.2.1", "2001:db8::1", "localhost", "", "127.0.0.1:80"}) {
    EXPECT_FALSE(IsOwnHost(host)) << host;
  }
}

class IsProxyOfEnvironmentTest : public ::testing::Test {
  const WithoutProxies without_proxies_;
};

TEST_F(IsProxyOfEnvironmentTest, OfTheAddressAndPortThatAVariableNames) {
  for (const char* name : {"http_proxy", "https_proxy", "HTTPS_PROXY", "all_proxy", "ALL_PROXY"}) {
    EXPECT_FALSE(Ask(IsProxyOfEnvironment, "127.0.0.1", "3128"));
    for (const char* proxy :
         {"http://127.0.0.1:3128", "127.0.0.1:3128", "socks5h://user:word@127.0.0.1:3128/"}) {
      setenv(name, proxy, 1);
      EXPECT_TRUE(Ask(IsProxyOfEnvironment, "127.0.0.1", "3128")) << proxy;
      EXPECT_FALSE(Ask(IsProxyOfEnvironment, "127.0.0.1", "3129")) << proxy;
      EXPECT_FALSE(Ask(IsProxyOfEnvironment, "127.0.0.2", "3128")) << proxy;
    }
    unsetenv(name);
  }
}

TEST_F(IsProxyOfEnvironmentTest, KnowsIpv6NamesAndThePortThatCurlTakes) {
  setenv("https_proxy", "http://[::1]:8080", 1);
  EXPECT_TRUE(Ask(IsProxyOfEnvironment, "::1", "8080"));
  setenv("https_proxy", "http://localhost:8080", 1);
  EXPECT_TRUE(Ask(IsProxyOfEnvironment, "127.0.0.1", "8080"));
  setenv("https_proxy", "127.0.0.1", 1);
  EXPECT_TRUE(Ask(IsProxyOfEnvironment, "127.0.0.1", "1080"));
  for (const char* proxy : {"", ":", "http://", "nonsense nonsense"}) {
    setenv("https_proxy", proxy, 1);
    EXPECT_FALSE(Ask(IsProxyOfEnvironment, "127.0.0.1", "1080")) << proxy;
  }
}

}  // namespace
}  // namespace liquidblend::client
