#include "client/src/connection/connection_failure.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace liquidblend::client {
namespace {

using ::testing::HasSubstr;

// gRPC's words, as tests/e2e/secure_test.cc meets them.
TEST(ExplainConnectionFailure, KnowsWhatEachSideMayHaveWrong) {
  const std::string prefix = "failed to connect to all addresses; last error: UNKNOWN: ipv4:1:2: ";
  const auto explain = [&](const char* words, bool uses_tls) {
    return ExplainConnectionFailure(prefix + words, uses_tls);
  };
  EXPECT_THAT(explain("Failed to connect to remote host: Connection refused", true),
              HasSubstr("nothing listens there"));
  EXPECT_THAT(explain("Socket closed", false), HasSubstr("wants TLS"));
  EXPECT_EQ(explain("Socket closed", true), "");
  EXPECT_THAT(explain("Ssl handshake failed: SSL_ERROR_SSL: error:0A00010B:SSL routines::wrong "
                      "version number",
                      true),
              HasSubstr("answers without TLS"));
  EXPECT_THAT(explain("Ssl handshake failed: SSL_ERROR_SSL: error:0A000086:SSL routines::"
                      "certificate verify failed",
                      true),
              HasSubstr("--tls-ca the file"));
  EXPECT_THAT(explain("Peer name 127.0.0.1 is not in peer certificate", true),
              HasSubstr("--tls-server-name"));
}

// A server that is stopped takes connections and says nothing; one that wants TLS ends them.
TEST(ExplainConnectionFailure, TellsASilentServerFromOneThatWantsTls) {
  for (const bool uses_tls : {false, true}) {
    for (const char* words : {"connection attempt timed out before receiving SETTINGS frame",
                              "connect timeout occurred", "Deadline Exceeded"}) {
      EXPECT_THAT(ExplainConnectionFailure(words, uses_tls), HasSubstr("nothing answers there"));
    }
  }
}

TEST(ExplainConnectionFailure, SaysNothingOfWordsThatItDoesNotKnow) {
  EXPECT_EQ(ExplainConnectionFailure("no words of ours", false), "");
  EXPECT_EQ(ExplainConnectionFailure("", true), "");
}

}  // namespace
}  // namespace liquidblend::client
