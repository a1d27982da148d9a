#include "client/src/upload_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/client/temp_files.h"

namespace liquidblend {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::TempDir;

TEST(ListAnimationFiles, FindsFramesVelocitiesAndMetaOnlySorted) {
  const TempDir dir;
  for (const char* name : {"m_0002.bobj.gz", "m_0001.bobj.gz", "v_0001.uni", "s_0001.stl",
                           "o_0001.vdb", "C_0001.OBJ", "meta.json", "notes.txt", "other.json"}) {
    dir.Write(name, "x");
  }
  std::filesystem::create_directory(dir.File("folder.ply"));
  const auto files = ListAnimationFiles(dir.path());
  ASSERT_TRUE(files.ok()) << files.status();
  EXPECT_THAT(*files,
              ElementsAre(dir.File("C_0001.OBJ"), dir.File("m_0001.bobj.gz"),
                          dir.File("m_0002.bobj.gz"), dir.File("meta.json"), dir.File("o_0001.vdb"),
                          dir.File("s_0001.stl"), dir.File("v_0001.uni")));
}

TEST(ListAnimationFiles, SaysWhatIsMissing) {
  const TempDir dir;
  dir.Write("meta.json", "{}");
  const absl::Status no_frames = ListAnimationFiles(dir.path()).status();
  EXPECT_EQ(no_frames.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(no_frames.message()), HasSubstr("no frames"));
  const absl::Status no_directory = ListAnimationFiles(dir.File("none")).status();
  EXPECT_EQ(no_directory.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(no_directory.message()), HasSubstr(dir.File("none")));
}

TEST(CheckUpload, RefusesTwoFilesOfOneNameAndChunksThatAreTooBig) {
  const TempDir a;
  const TempDir b;
  UploadRequest request;
  request.files = {a.Write("f_1.ply", "1"), b.Write("f_1.ply", "2")};
  EXPECT_THAT(client::CheckUpload(request).status().ToString(), HasSubstr("called f_1.ply"));
  request.files.pop_back();
  EXPECT_TRUE(client::CheckUpload(request).ok());
  request.chunk_bytes = (1 << 20) + 1;
  EXPECT_THAT(client::CheckUpload(request).status().ToString(), HasSubstr("chunk_bytes"));
}

TEST(ListAnimationFiles, ChoosesFramesByAPattern) {
  const TempDir dir;
  for (const char* name : {"foam.0001.ply", "liquid.0001.ply", "liquid.0002.ply", "meta.json"}) {
    dir.Write(name, "x");
  }
  const auto files = ListAnimationFiles(dir.path(), "liquid.*");
  ASSERT_TRUE(files.ok()) << files.status();
  EXPECT_THAT(*files, ElementsAre(dir.File("liquid.0001.ply"), dir.File("liquid.0002.ply"),
                                  dir.File("meta.json")));
  const absl::Status none = ListAnimationFiles(dir.path(), "water.*").status();
  EXPECT_EQ(none.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(none.message()),
              HasSubstr("none of its 3 frames, such as foam.0001.ply, is called 'water.*'"));
}

TEST(ListAnimationFiles, SaysThatAFileIsNoFolder) {
  const TempDir dir;
  const absl::Status status = ListAnimationFiles(dir.Write("f_1.ply", "x")).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(status.message()), HasSubstr("f_1.ply: is a file; give the folder"));
}

TEST(CheckUpload, RefusesNamesThatMakeNoSequence) {
  const TempDir dir;
  UploadRequest request;
  request.files = {dir.Write("f_1.ply", "1"), dir.Write("f_3.ply", "3")};
  EXPECT_THAT(client::CheckUpload(request).status().ToString(), HasSubstr("frame 2 is missing"));
  request.options.frame_times = {0, 2};
  EXPECT_TRUE(client::CheckUpload(request).ok());
  request.options.frame_times.clear();
  request.files.push_back(dir.Write("meta.json", R"({"fps": 24})"));
  EXPECT_FALSE(client::CheckUpload(request).ok());
  dir.Write("meta.json", R"({"frame_times": [0, 2]})");
  EXPECT_TRUE(client::CheckUpload(request).ok());
}

TEST(ReadChunks, NoticesAFileThatHasChangedItsSize) {
  const TempDir dir;
  client::UploadFile file{dir.Write("f.ply", "12345"), "f.ply", 5};
  std::string joined;
  const auto join = [&](std::string bytes) {
    joined += bytes;
    return true;
  };
  EXPECT_TRUE(client::ReadChunks(file, 2, join).ok());
  EXPECT_EQ(joined, "12345");
  for (const int64_t wrong : {4, 6}) {
    file.size_bytes = wrong;
    EXPECT_EQ(client::ReadChunks(file, 2, join).code(), absl::StatusCode::kDataLoss) << wrong;
  }
}

}  // namespace
}  // namespace liquidblend
