#include "client/src/connection/loopback.h"

#include <gtest/gtest.h>

#include "client/src/credentials.h"

namespace liquidblend::client {
namespace {

constexpr const char* kHere[] = {
    "127.0.0.1:50051",
    "127.255.1.2:1",
    "localhost:50051",
    "LOCALHOST:50051",
    "localhost",
    "[::1]:50051",
    "[::ffff:127.0.0.1]:50051",
    "unix:/run/liquidblend",
    "unix:///run/liquidblend",
    "unix-abstract:liquidblend",
    "dns:///localhost:50051",
    "dns:127.0.0.1:50051",
    "ipv4:127.0.0.1:50051",
    "ipv4:127.0.0.1:50051,127.0.0.2:50051",
    "ipv6:[::1]:50051",
    "ipv6:///[::1]:50051",
};

constexpr const char* kElsewhere[] = {
    "",
    "127.example.org:50051",
    "127.0.0.1.example.org:50051",
    "127.0.0.1.:50051",
    "localhost.:50051",
    "localhost.example.org:50051",
    "127.0.0.1@example.org:50051",
    "user@127.0.0.1:50051",
    "127.0.0.1:50051@example.org",
    "127.0.0.1:50051/x",
    "0.0.0.0:50051",
    "128.0.0.1:50051",
    "[::]:50051",
    "[::ffff:8.8.8.8]:50051",
    "[::1",
    "[::1].example.org:50051",
    "dns://8.8.8.8/localhost:50051",
    "dns:///127.example.org:50051",
    "ipv4:127.0.0.1:50051,8.8.8.8:50051",
    "ipv4:127.0.0.1%2c8.8.8.8:50051",
    "ipv6:[::1]:50051,[2001:db8::1]:50051",
    "xds:///127.0.0.1:50051",
};

TEST(IsThisMachine, LooksAtWholeAddresses) {
  for (const char* target : kHere) EXPECT_TRUE(IsThisMachine(target)) << target;
  for (const char* target : kElsewhere) EXPECT_FALSE(IsThisMachine(target)) << target;
}

TEST(CheckTokenIsSafe, ATokenStaysOnThisMachineUnlessThereIsTls) {
  SecurityOptions options;
  options.token = "secret";
  for (const char* target : kHere) EXPECT_TRUE(CheckTokenIsSafe(options, target).ok()) << target;
  for (const char* target : kElsewhere) {
    const absl::Status status = CheckTokenIsSafe(options, target);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << target;
    EXPECT_EQ(status.message().find("secret"), absl::string_view::npos);
  }
  options.tls = true;
  for (const char* target : kElsewhere) EXPECT_TRUE(CheckTokenIsSafe(options, target).ok());
}

}  // namespace
}  // namespace liquidblend::client
