#include "core/base/nearest.h"

#include <gtest/gtest.h>

namespace liquidblend::base {
namespace {

const std::vector<std::string> kCommands = {"check", "collect", "jobs", "export", "import"};

TEST(Nearest, FindsALetterInsertedRemovedReplacedOrSwapped) {
  for (const char* const word : {"chheck", "chek", "chack", "chekc"}) {
    EXPECT_EQ(Nearest(word, kCommands), "check") << word;
  }
  EXPECT_EQ(Nearest("colect", kCommands), "collect");
}

TEST(Nearest, PrefersFewerEdits) {
  EXPECT_EQ(Nearest("inport", kCommands), "import");
  EXPECT_EQ(Nearest("expott", kCommands), "export");
}

TEST(Nearest, IsNothingIfAllAreFar) {
  EXPECT_EQ(Nearest("backup", kCommands), "");
  EXPECT_EQ(Nearest("jb", {"list", "ls-all"}), "");
  EXPECT_EQ(Nearest("cheeeck", kCommands), "check");
  EXPECT_EQ(Nearest("cheeeeck", kCommands), "") << "three letters";
  EXPECT_EQ(Nearest("j", kCommands), "") << "any short word is near";
  EXPECT_EQ(Nearest("check", {}), "");
}

TEST(UnknownCommandMessage, SuggestsTheNearestCommandIfThereIsOne) {
  EXPECT_EQ(UnknownCommandMessage("admin", "chek", kCommands),
            "admin: there is no command 'chek'; did you mean 'check'?\n"
            "`admin --help` lists all commands.\n");
  EXPECT_EQ(UnknownCommandMessage("admin", "backup", kCommands),
            "admin: there is no command 'backup'\n`admin --help` lists all commands.\n");
}

}  // namespace
}  // namespace liquidblend::base
