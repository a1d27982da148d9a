#include "tests/e2e/faults/fault_disk.h"

#include <filesystem>

#include "tests/core/store/store_testing.h"

namespace liquidblend::e2e {
namespace {

using store::ReadFile;
using testing::AnyOf;
using testing::Eq;

class LosePowerTest : public testing::Test {
 protected:
  LosePowerTest() : folder_(root_.path() + "/data"), disk_(root_.path() + "/disk") {
    std::filesystem::create_directories(folder_ + "/inner");
    std::filesystem::create_directories(disk_);
    store::WriteFile(folder_ + "/inner/old", "old");
    KeepTree(disk_, folder_);
  }

  static bool Exists(const std::string& path) { return std::filesystem::exists(path); }

  const store::TemporaryFolder root_;
  const std::string folder_, disk_;
};

TEST_F(LosePowerTest, LeavesTheBytesOfTheLastFlush) {
  std::ofstream(folder_ + "/inner/old", std::ios::app) << " and new";
  LosePower(disk_, folder_, 0);
  EXPECT_EQ(ReadFile(folder_ + "/inner/old"), "old");
}

TEST_F(LosePowerTest, LosesANameThatItsFolderHasNotFlushed) {
  store::WriteFile(folder_ + "/new", "new");
  KeepFile(disk_, folder_ + "/new");
  LosePower(disk_, folder_, 0);
  EXPECT_FALSE(Exists(folder_ + "/new"));
  EXPECT_TRUE(Exists(folder_ + "/inner/old"));
}

TEST_F(LosePowerTest, LosesTheBytesOfANameThatAloneWasFlushed) {
  store::WriteFile(folder_ + "/new", "new");
  KeepFolder(disk_, folder_);
  LosePower(disk_, folder_, 0);
  EXPECT_TRUE(Exists(folder_ + "/new"));
  EXPECT_EQ(ReadFile(folder_ + "/new"), "");
}

TEST_F(LosePowerTest, UndoesARenameThatWasNotFlushed) {
  std::filesystem::rename(folder_ + "/inner/old", folder_ + "/moved");
  LosePower(disk_, folder_, 0);
  EXPECT_EQ(ReadFile(folder_ + "/inner/old"), "old");
  EXPECT_FALSE(Exists(folder_ + "/moved"));
}

TEST_F(LosePowerTest, KeepsWhatWasFlushed) {
  store::WriteFile(folder_ + "/new", "new");
  KeepFile(disk_, folder_ + "/new");
  KeepFolder(disk_, folder_);
  LosePower(disk_, folder_, 0);
  EXPECT_EQ(ReadFile(folder_ + "/new"), "new");
}

TEST_F(LosePowerTest, ByChanceSomeOfTheRestIsThere) {
  const std::string path = folder_ + "/inner/old";
  std::ofstream(path, std::ios::app) << " and new";
  LosePower(disk_, folder_, 1);
  EXPECT_THAT(ReadFile(path).substr(0, 3), Eq("old"));
  EXPECT_THAT(ReadFile(path).size(), AnyOf(Eq(3U), Eq(11U)));
}

}  // namespace
}  // namespace liquidblend::e2e
