#include "server/http/exchange/protocols.h"

#include <gtest/gtest.h>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"

namespace liquidblend::http {
namespace {

TEST(ParseProtocols, FindsOursAndTheToken) {
  const std::string token = "abc?>~0123";
  const Protocols both = ParseProtocols(absl::StrCat("liquidblend.v1, liquidblend.bearer.",
                                                     absl::WebSafeBase64Escape(token), ",chat"));
  EXPECT_TRUE(both.has_ours);
  EXPECT_EQ(both.token, token);
  EXPECT_FALSE(ParseProtocols("").has_ours);
  EXPECT_EQ(ParseProtocols("liquidblend.v2 , chat").token, "");
  EXPECT_FALSE(ParseProtocols("liquidblend.v2").has_ours);
}

TEST(ParseProtocols, TakesWhatIsNoBase64AsItIs) {
  EXPECT_EQ(ParseProtocols("liquidblend.bearer.!!").token, "!!");
  EXPECT_EQ(ParseProtocols("liquidblend.bearer.").token, "");
}

}  // namespace
}  // namespace liquidblend::http
