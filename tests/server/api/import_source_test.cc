#include "server/api/import_source.h"

#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <map>

#include "tests/server/backends_testing.h"

namespace liquidblend::server {
namespace {

namespace fs = std::filesystem;
using store::Fails;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using testing::Pair;

// root/shot/f1.ply and f2.ply, which clients know as sims/shot; and outside/, which they do not.
class ImportSourceTest : public testing::Test {
 protected:
  ImportSourceTest() : roots_{{"sims", folder_.path() + "/root"}} {
    Write("root/shot/f2.ply", "two");
    Write("root/shot/f1.ply", "one");
    Write("root/shot/meta.json", "{}");
    Write("root/shot/notes.txt", "no frame");
    Write("outside/f1.ply", "secret");
  }

  std::string path(const std::string& name) const { return folder_.path() + "/" + name; }

  void Write(const std::string& name, const std::string& text) const {
    fs::create_directories(fs::path(path(name)).parent_path());
    std::ofstream(path(name), std::ios::binary) << text;
  }

  absl::StatusOr<ImportSource> Open(const std::string& location, int max_files = 100) const {
    return ImportSource::Open(roots_, location, max_files);
  }

  // Name -> content, in order.
  using Files = std::vector<std::pair<std::string, std::string>>;
  absl::StatusOr<Files> Read(const std::string& location, const std::string& pattern = "") const {
    absl::StatusOr<ImportSource> source =
        ImportSource::Open(roots_, location, /*max_files=*/100, pattern);
    if (!source.ok()) return source.status();
    Files files;
    v1::UploadAnimationRequest message;
    while (true) {
      const absl::StatusOr<bool> more = source->Next(message);
      if (!more.ok()) return more.status();
      if (!*more) return files;
      if (message.has_file()) files.emplace_back(message.file().name(), "");
      if (message.has_chunk()) files.back().second += message.chunk();
    }
  }

  // Checks that it is refused, blames the location, and tells nothing of the server's directories.
  std::string Refusal(const std::string& location, absl::StatusCode code) const {
    const absl::Status status = Read(location).status();
    EXPECT_EQ(status.code(), code) << location << ": " << status;
    EXPECT_THAT(BlamedFields(status), ElementsAre("location"));
    EXPECT_THAT(status.ToString(), Not(HasSubstr(folder_.path())));
    EXPECT_THAT(status.ToString(), Not(HasSubstr("secret")));
    EXPECT_THAT(status.ToString(), Not(HasSubstr("outside")));
    return ReasonOf(status);
  }

  const store::TemporaryFolder folder_;
  const ImportRoots roots_;
};

TEST_F(ImportSourceTest, APatternChoosesFramesAndNothingElse) {
  Write("root/shot/foam1.ply", "foam");
  Write("root/shot/lVelMesh_1.uni", "velocities");
  const absl::StatusOr<Files> files = Read("sims/shot", "f[12].*");
  ASSERT_TRUE(files.ok()) << files.status();
  EXPECT_THAT(*files, ElementsAre(Pair("f1.ply", "one"), Pair("f2.ply", "two"),
                                  Pair("lVelMesh_1.uni", "velocities"), Pair("meta.json", "{}")));
  EXPECT_THAT(std::string(Read("sims/shot", "liquid.*").status().message()),
              HasSubstr("'sims/shot' holds no frames (*.bobj.gz, *.ply, *.obj, *.stl or *.vdb) "
                        "called 'liquid.*'"));
}

TEST_F(ImportSourceTest, GivesTheAnimationsFilesInOrder) {
  const auto files = Read("sims/shot");
  ASSERT_TRUE(files.ok()) << files.status();
  EXPECT_THAT(*files,
              ElementsAre(Pair("f1.ply", "one"), Pair("f2.ply", "two"), Pair("meta.json", "{}")));
}

TEST_F(ImportSourceTest, LargeFilesComeInChunksAndEmptyOnesAsWell) {
  const std::string large(1'300'000, 'x');
  Write("root/large/f1.ply", large);
  Write("root/large/f2.ply", "");
  const auto files = Read("sims/large");
  ASSERT_TRUE(files.ok()) << files.status();
  EXPECT_THAT(*files, ElementsAre(Pair("f1.ply", large), Pair("f2.ply", "")));
}

TEST_F(ImportSourceTest, TheRootItselfMayHoldFrames) {
  Write("root/f1.ply", "here");
  EXPECT_THAT(*Read("sims"), ElementsAre(Pair("f1.ply", "here")));
}

TEST_F(ImportSourceTest, NothingLeadsOutByItsName) {
  using enum absl::StatusCode;
  for (const char* location : {"sims/../sims/shot", "sims/shot/..", "sims/./shot", "sims//shot",
                               "/sims/shot", "sims/shot/", "", "/", "..", "sims/shot\n"}) {
    Refusal(location, kInvalidArgument);
  }
  Refusal(std::string("sims/shot\0x", 11), kInvalidArgument);
  Refusal(std::string(5000, 'a'), kInvalidArgument);
  EXPECT_EQ(Refusal("other/shot", kNotFound), "IMPORT_ROOT_UNKNOWN");
  Refusal("sims/none", kNotFound);
}

TEST_F(ImportSourceTest, NoSymbolicLinkIsFollowed) {
  using enum absl::StatusCode;
  fs::create_symlink(path("outside"), path("root/absolute"));
  fs::create_symlink("../outside", path("root/relative"));
  fs::create_symlink("shot", path("root/inside"));
  EXPECT_EQ(Refusal("sims/absolute", kFailedPrecondition), "NOT_A_DIRECTORY");
  EXPECT_EQ(Refusal("sims/relative", kFailedPrecondition), "NOT_A_DIRECTORY");
  EXPECT_EQ(Refusal("sims/inside", kFailedPrecondition), "NOT_A_DIRECTORY");
  EXPECT_EQ(Refusal("sims/shot/f1.ply", kFailedPrecondition), "NOT_A_DIRECTORY");
  fs::create_directory(path("root/links"));
  fs::create_symlink(path("outside/f1.ply"), path("root/links/f1.ply"));
  EXPECT_EQ(Refusal("sims/links", kFailedPrecondition), "NOT_A_FILE");
}

TEST_F(ImportSourceTest, ALinkThatIsSwappedInAfterTheListingIsNotFollowedEither) {
  auto source = Open("sims/shot");
  ASSERT_TRUE(source.ok());
  fs::remove(path("root/shot/f1.ply"));
  fs::create_symlink(path("outside/f1.ply"), path("root/shot/f1.ply"));
  fs::rename(path("root/shot"), path("root/moved"));
  fs::create_symlink(path("outside"), path("root/shot"));
  v1::UploadAnimationRequest message;
  EXPECT_EQ(ReasonOf(source->Next(message).status()), "NOT_A_FILE");
}

TEST_F(ImportSourceTest, OnlyRegularFilesAreRead) {
  using enum absl::StatusCode;
  fs::create_directory(path("root/pipe"));
  ASSERT_EQ(mkfifo(path("root/pipe/f1.ply").c_str(), 0600), 0);
  EXPECT_EQ(Refusal("sims/pipe", kFailedPrecondition), "NOT_A_FILE");
  fs::create_directories(path("root/directory/f1.ply"));
  EXPECT_EQ(Refusal("sims/directory", kFailedPrecondition), "NOT_A_FILE");
}

TEST_F(ImportSourceTest, ADirectoryWithoutFramesIsRefused) {
  Write("root/empty/meta.json", "{}");
  EXPECT_EQ(Refusal("sims/empty", absl::StatusCode::kFailedPrecondition), "NO_FRAMES");
}

TEST_F(ImportSourceTest, AFileThatShrinksMeanwhileIsToldOf) {
  Write("root/shot/f1.ply", std::string(1'000'000, 'x'));
  auto source = Open("sims/shot");
  v1::UploadAnimationRequest message;
  ASSERT_TRUE(*source->Next(message));
  EXPECT_EQ(message.file().size_bytes(), 1'000'000);
  fs::resize_file(path("root/shot/f1.ply"), 10);
  ASSERT_TRUE(*source->Next(message));
  EXPECT_EQ(message.chunk().size(), 10U);
  EXPECT_EQ(ReasonOf(source->Next(message).status()), "FILE_CHANGED");
}

TEST_F(ImportSourceTest, RootsAreParsedFromTheirFlags) {
  const std::string directory = path("root");
  EXPECT_THAT(*ParseImportRoots({"a=" + directory, "b=" + directory}),
              ElementsAre(Pair("a", directory), Pair("b", directory)));
  EXPECT_THAT(ParseImportRoots({directory}).status(),
              Fails(absl::StatusCode::kInvalidArgument, "NAME=DIR"));
  EXPECT_THAT(ParseImportRoots({"A/b=" + directory}).status(),
              Fails(absl::StatusCode::kInvalidArgument, "NAME=DIR"));
  EXPECT_THAT(ParseImportRoots({"a=" + path("none")}).status(),
              Fails(absl::StatusCode::kNotFound, "none"));
  EXPECT_THAT(ParseImportRoots({"a=" + directory, "a=" + directory}).status(),
              Fails(absl::StatusCode::kInvalidArgument, "twice"));
}

}  // namespace
}  // namespace liquidblend::server
