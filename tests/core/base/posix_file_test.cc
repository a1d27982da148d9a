#include "core/base/posix_file.h"

#include <fcntl.h>

#include <cerrno>

#include "tests/core/store/store_testing.h"

namespace liquidblend::base {
namespace {

using store::AsBytes;
using store::AsString;
using store::Fails;
using store::SampleBytes;
using store::StartChild;
using store::Succeeds;
using store::TemporaryFolder;
using store::WaitFor;
using store::WriteFile;

TEST(WriteAll, NamesThePathWhenTheDiskIsFull) {
  const auto full = OpenFile("/dev/full", O_WRONLY);
  ASSERT_THAT(full, Succeeds());
  const absl::Status written = WriteAll(*full, AsBytes("water"), "/dev/full");
  EXPECT_THAT(written,
              Fails(absl::StatusCode::kResourceExhausted, "write /dev/full: No space left"));
  EXPECT_TRUE(IsDiskFull(written));
}

TEST(IsDiskFull, IsNeitherALackOfDescriptorsNorOfMemory) {
  EXPECT_TRUE(IsDiskFull(ErrnoStatus(EDQUOT, "write", "/a")));
  for (const int error : {EFBIG, EMFILE, ENFILE, ENOMEM, EIO}) {
    EXPECT_FALSE(IsDiskFull(ErrnoStatus(error, "write", "/a"))) << error;
  }
  EXPECT_FALSE(IsDiskFull(absl::OkStatus()));
}

TEST(WriteAll, WritesThroughAPipeThatTakesLittleAtATime) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  const FileHandle read_end(ends[0]);
  FileHandle write_end(ends[1]);
  const std::string content = SampleBytes(300000);  // more than a pipe holds
  const pid_t child =
      StartChild([&] { return WriteAll(write_end, AsBytes(content), "pipe").ok() ? 0 : 1; });
  write_end = FileHandle();
  std::string received;
  char buffer[1000];
  for (ssize_t n = 0; (n = read(read_end.fd(), buffer, sizeof(buffer))) > 0;) {
    received.append(buffer, static_cast<size_t>(n));
  }
  EXPECT_EQ(WaitFor(child), 0);
  EXPECT_TRUE(received == content);
}

TEST(ReadAll, NoticesAFileThatEndsEarly) {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/short";
  WriteFile(path, SampleBytes(2000000));
  const auto file = OpenFile(path, O_RDONLY);
  ASSERT_THAT(file, Succeeds());
  std::string content;
  const auto take = [&](std::span<const std::byte> bytes) { content += AsString(bytes); };
  EXPECT_THAT(ReadAll(*file, 2000000, path, take), Succeeds());
  EXPECT_TRUE(content == SampleBytes(2000000));
  EXPECT_THAT(ReadAll(*file, 2000001, path, take),
              Fails(absl::StatusCode::kDataLoss, "ends after 2000000 of 2000001 bytes"));
}

TEST(ReadAll, NamesWhatCannotBeRead) {
  const TemporaryFolder folder;
  const auto directory = OpenFile(folder.path(), O_RDONLY | O_DIRECTORY);
  ASSERT_THAT(directory, Succeeds());
  EXPECT_THAT(ReadAll(*directory, 1, folder.path(), [](auto) {}),
              Fails(absl::StatusCode::kUnavailable, "read " + folder.path()));
}

TEST(ErrnoStatus, TellsCallersWhatToDo) {
  using StatusCode = absl::StatusCode;
  EXPECT_THAT(ErrnoStatus(ENOENT, "open", "/a"),
              Fails(StatusCode::kNotFound, "open /a: No such file"));
  EXPECT_THAT(ErrnoStatus(EACCES, "open", "/a"), Fails(StatusCode::kPermissionDenied, "/a"));
  EXPECT_THAT(ErrnoStatus(EROFS, "open", "/a"), Fails(StatusCode::kPermissionDenied, "/a"));
  EXPECT_THAT(ErrnoStatus(ENOSPC, "write", "/a"), Fails(StatusCode::kResourceExhausted, "/a"));
  EXPECT_THAT(ErrnoStatus(EDQUOT, "write", "/a"), Fails(StatusCode::kResourceExhausted, "/a"));
  EXPECT_THAT(ErrnoStatus(EMFILE, "open", "/a"), Fails(StatusCode::kResourceExhausted, "/a"));
  EXPECT_THAT(ErrnoStatus(EIO, "write", "/a"), Fails(StatusCode::kUnavailable, "/a"));
  EXPECT_THAT(ErrnoStatus(ENOTDIR, "open", "/a"), Fails(StatusCode::kUnavailable, "/a"));
}

TEST(MakeDirectories, MakesParents) {
  const TemporaryFolder folder;
  EXPECT_THAT(MakeDirectories(folder.path() + "/a/b//c/"), Succeeds());
  EXPECT_TRUE(std::filesystem::is_directory(folder.path() + "/a/b/c"));
  EXPECT_THAT(MakeDirectories(folder.path() + "/a/b/c"), Succeeds());
}

TEST(MakeDirectories, NamesAFileInTheWay) {
  const TemporaryFolder folder;
  WriteFile(folder.path() + "/a", "file");
  EXPECT_THAT(MakeDirectories(folder.path() + "/a"),
              Fails(absl::StatusCode::kUnavailable, folder.path() + "/a: Not a directory"));
  EXPECT_THAT(MakeDirectories(folder.path() + "/a/b"),
              Fails(absl::StatusCode::kUnavailable, folder.path() + "/a"));
}

TEST(FileHandle, ClosesWhatItOwns) {
  int fd = -1;
  {
    auto file = OpenFile("/dev/null", O_RDONLY);
    ASSERT_THAT(file, Succeeds());
    const FileHandle moved = *std::move(file);
    fd = moved.fd();
    EXPECT_TRUE(moved.is_open());
    EXPECT_NE(fcntl(fd, F_GETFD), -1);
  }
  EXPECT_EQ(fcntl(fd, F_GETFD), -1);
}

}  // namespace
}  // namespace liquidblend::base
