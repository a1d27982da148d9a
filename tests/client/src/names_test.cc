#include "client/src/names.h"

#include <gtest/gtest.h>

#include <string>

namespace liquidblend::client {
namespace {

TEST(IsSafeToPaste, TakesOnlyWhatNoShellReadsAsMore) {
  EXPECT_TRUE(IsSafeToPaste("operations/import-0a1B_2.c"));
  for (const char* name : {"", "-q", "a b", "a;b", "`a`", "$(a)", "a\nb", "a'b", "a\\b", "\xC3\xA4",
                           "~/a", "a=b", "a*"}) {
    EXPECT_FALSE(IsSafeToPaste(name)) << name;
  }
  EXPECT_FALSE(IsSafeToPaste(std::string(201, 'a')));
}

}  // namespace
}  // namespace liquidblend::client
