#include "worker/ingest/read_directory.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace liquidblend::ingest {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class LoadDirectoryTest : public testing::Test {
 protected:
  LoadDirectoryTest()
      : folder_(
            fs::path(testing::TempDir()) /
            (std::string("lb_") + testing::UnitTest::GetInstance()->current_test_info()->name())) {
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "folder_0009.ply");
    for (const char* name : {"b_0002.ply", "a_0001.ply", "liquid_0001.png", "meta.json"}) {
      std::ofstream(folder_ / name) << name;
    }
    fs::create_symlink(folder_ / "a_0001.ply", folder_ / "link_0003.ply");
    fs::create_symlink(folder_ / "gone", folder_ / "link_0004.ply");
  }
  ~LoadDirectoryTest() override { fs::remove_all(folder_); }

  const fs::path folder_;
};

TEST_F(LoadDirectoryTest, LoadsRegularFilesThatMayBeFramesInOrder) {
  const absl::StatusOr<std::vector<LoadedFile>> files = LoadDirectory(folder_.string());
  ASSERT_TRUE(files.ok()) << files.status();
  const std::vector<InputFile> views = Views(*files);
  ASSERT_EQ(views.size(), 4u);
  EXPECT_EQ(views[0].name, "a_0001.ply");
  EXPECT_EQ(views[1].name, "b_0002.ply");
  EXPECT_EQ(views[2].name, "link_0003.ply");
  EXPECT_EQ(views[3].name, "meta.json");
  EXPECT_EQ(
      std::string(reinterpret_cast<const char*>(views[2].bytes.data()), views[2].bytes.size()),
      "a_0001.ply");
}

TEST_F(LoadDirectoryTest, RefusesMoreBytesThanAllowed) {
  const std::string path = folder_.string();
  EXPECT_TRUE(LoadDirectory(path, {.max_total_bytes = 39}).ok());
  const absl::Status status = LoadDirectory(path, {.max_total_bytes = 38}).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(status.message()), HasSubstr("meta.json: 9 bytes"));
}

TEST_F(LoadDirectoryTest, NamesAFolderThatIsNotThere) {
  const absl::Status status = LoadDirectory((folder_ / "nowhere").string()).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(status.message()), HasSubstr("nowhere"));
}

}  // namespace
}  // namespace liquidblend::ingest
