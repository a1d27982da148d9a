#include "core/base/host.h"

#include <gtest/gtest.h>

#include <string>

namespace liquidblend::base {
namespace {

TEST(SplitHostPort, TakesNamesAndAddressesWithAndWithoutPort) {
  const auto name = SplitHostPort("example.org:80");
  ASSERT_TRUE(name.has_value());
  EXPECT_EQ(std::string(name->host), "example.org");
  EXPECT_EQ(std::string(name->port), "80");
  EXPECT_EQ(std::string(SplitHostPort("example.org")->host), "example.org");
  const auto v6 = SplitHostPort("[::1]:80");
  ASSERT_TRUE(v6.has_value());
  EXPECT_TRUE(v6->is_bracketed);
  EXPECT_EQ(std::string(v6->host), "::1");
  EXPECT_EQ(std::string(v6->port), "80");
  EXPECT_EQ(std::string(SplitHostPort("[::1]")->host), "::1");
}

TEST(SplitHostPort, RefusesEverythingElse) {
  for (const char* text : {"", ":80", "[]", "[]:80", "[::1", "[::1]80", "::1", "::1:80", "a:b",
                           "a:80:80", "a]:80", "a[b:80", "127.0.0.1:80@evil.org", "a:-1"}) {
    EXPECT_FALSE(SplitHostPort(text).has_value()) << text;
  }
}

TEST(IsIpAddress, TakesNoNames) {
  for (const char* text : {"127.0.0.1", "0.0.0.0", "8.8.8.8", "::", "::1", "2001:db8::1"}) {
    EXPECT_TRUE(IsIpAddress(text)) << text;
  }
  for (const char* text : {"", "localhost", "127.1", "127.0.0.1.", "1.2.3.4.evil.org", "[::1]",
                           "::1%lo", "0x7f.0.0.1", "127.0.0.256"}) {
    EXPECT_FALSE(IsIpAddress(text)) << text;
  }
}

TEST(IsLoopbackHost, LooksAtTheWholeAddress) {
  for (const char* text : {"127.0.0.1", "127.255.0.3", "localhost", "LocalHost", "::1",
                           "0:0:0:0:0:0:0:1", "::ffff:127.0.0.1"}) {
    EXPECT_TRUE(IsLoopbackHost(text)) << text;
  }
  for (const char* text :
       {"", "127.example.org", "127.0.0.1.example.org", "127.0.0.1.", "localhost.", "127.",
        "localhost.example.org", "user@127.0.0.1", "127.1", "128.0.0.1", "0.0.0.0",
        "::", "::ffff:8.8.8.8", "::127.0.0.1", "::1%lo", "[::1]", "1.0.0.127"}) {
    EXPECT_FALSE(IsLoopbackHost(text)) << text;
  }
  EXPECT_FALSE(IsLoopbackHost(absl::string_view("127.0.0.1\0.evil.org", 19)));
}

}  // namespace
}  // namespace liquidblend::base
