#include "core/base/version.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace liquidblend::base {
namespace {

using testing::HasSubstr;
using testing::MatchesRegex;

TEST(Version, NamesTheCommit) {
  EXPECT_THAT(kCommit, MatchesRegex("[A-Za-z0-9._-]+"));
  EXPECT_THAT(Version(), MatchesRegex("[0-9]+\\.[0-9]+\\.[0-9]+ \\(commit .+\\)"));
  EXPECT_THAT(Version(), HasSubstr(std::string("(commit ") + kCommit + ")"));
}

TEST(VersionLine, NamesTablesOnlyOfProgramsThatHaveThem) {
  EXPECT_EQ(VersionLine("liquidblend"), "liquidblend " + Version());
  EXPECT_EQ(VersionLine("liquidblend-admin", "tables 7"),
            "liquidblend-admin " + Version() + ", tables 7");
}

}  // namespace
}  // namespace liquidblend::base
