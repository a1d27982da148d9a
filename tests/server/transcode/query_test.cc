#include "server/transcode/query.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "absl/strings/str_cat.h"
#include "tests/core/store/store_testing.h"

namespace liquidblend::transcode {
namespace {

using store::Fails;
using testing::ElementsAre;

MATCHER_P2(Is, name, value, "") { return arg.name == name && arg.value == value; }

const auto kRefused = absl::StatusCode::kInvalidArgument;

TEST(ParseQuery, KeepsOrderAndDecodes) {
  const auto fields = ParseQuery("weights=0.5,0.1&time=1e+0&name=a%3d%62&flag&&empty=");
  ASSERT_TRUE(fields.ok()) << fields.status();
  EXPECT_THAT(*fields, ElementsAre(Is("weights", "0.5,0.1"), Is("time", "1e+0"), Is("name", "a=b"),
                                   Is("flag", ""), Is("empty", "")));
  EXPECT_TRUE(ParseQuery("")->empty());
  EXPECT_THAT(*ParseQuery("a=b=c"), ElementsAre(Is("a", "b=c")));
}

TEST(ParseQuery, RefusesWhatIsBroken) {
  EXPECT_THAT(ParseQuery("a=%4"), Fails(kRefused, "'%4'"));
  EXPECT_THAT(ParseQuery("a=%zz1"), Fails(kRefused, "'%zz1'"));
  EXPECT_THAT(ParseQuery("a=%00"), Fails(kRefused, "printable"));
  EXPECT_THAT(ParseQuery("a=\xff"), Fails(kRefused, "printable"));
  EXPECT_THAT(ParseQuery("=1"), Fails(kRefused, "no name"));
  EXPECT_THAT(ParseQuery("a=1&b=2&%61=3"), Fails(kRefused, "a is given twice"));
  std::string many;
  for (int i = 0; i < 33; ++i) absl::StrAppend(&many, "f", i, "=1&");
  EXPECT_THAT(ParseQuery(many), Fails(kRefused, "32"));
}

}  // namespace
}  // namespace liquidblend::transcode
