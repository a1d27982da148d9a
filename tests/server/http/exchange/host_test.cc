#include "server/http/exchange/host.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "absl/strings/string_view.h"

namespace liquidblend::http {
namespace {

TEST(CheckHost, TakesAddressesLocalhostAndItsNames) {
  for (const char* host : {"", "localhost", "localhost:8080", "LocalHost.:8080", "127.0.0.1:8080",
                           "10.1.2.3", "[::1]:8080", "[2001:db8::1]", "frames.example.org",
                           "Frames.Example.Org:443", "frames.example.org.", "liquidblend:8080"}) {
    EXPECT_TRUE(CheckHost(host, {"frames.example.org", "liquidblend"}).ok()) << host;
  }
}

TEST(CheckHost, RefusesAllOtherNames) {
  for (const char* host :
       {"evil.example", "evil.example:8080", "localhost.evil.example", "127.0.0.1.evil.example",
        "frames.example.org.evil.example", "evil-frames.example.org", "evil.example, localhost",
        "localhost, evil.example", "user@localhost", "localhost:8080@evil.example", "::1",
        "[::1].evil.example", "[localhost]", "[evil.example]", "localhost/", "127.1", " ", "*"}) {
    const absl::Status status = CheckHost(host, {"frames.example.org"});
    EXPECT_EQ(status.code(), absl::StatusCode::kPermissionDenied) << host;
    EXPECT_THAT(std::string(status.message()), testing::HasSubstr("--http-host")) << host;
  }
}

TEST(CheckHost, AStarTakesAny) { EXPECT_TRUE(CheckHost("evil.example", {"*"}).ok()); }

TEST(IsHostName, IsANameWithoutPortOrAStar) {
  for (const char* name : {"*", "liquidblend", "frames.example.org", "a_b-c.example"}) {
    EXPECT_TRUE(IsHostName(name)) << name;
  }
  for (const char* name : {"", "a:80", "http://a", "a b", "*.example.org", "[::1]", "a/b"}) {
    EXPECT_FALSE(IsHostName(name)) << name;
  }
}

}  // namespace
}  // namespace liquidblend::http
