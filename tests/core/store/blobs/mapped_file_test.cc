#include "core/store/blobs/mapped_file.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>

#include "tests/core/store/store_testing.h"

namespace liquidblend::store {
namespace {

constexpr size_t kPage = 4096;

std::shared_ptr<const Blob> MustMap(const std::string& path, size_t size) {
  const auto file = base::OpenFile(path, O_RDONLY);
  EXPECT_THAT(file, Succeeds());
  auto blob = MapFile(*file, size, path);
  EXPECT_THAT(blob, Succeeds());
  return blob.ok() ? *std::move(blob) : nullptr;
}

TEST(MappedFile, ShowsTheFile) {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/file", content = SampleBytes(3 * kPage + 17);
  WriteFile(path, content);
  const auto blob = MustMap(path, content.size());
  std::filesystem::remove(path);
  EXPECT_TRUE(AsString(blob->bytes()) == content);
  EXPECT_THAT(blob->Check(), Succeeds());
  WriteFile(path, "");
  EXPECT_TRUE(MustMap(path, 0)->bytes().empty());
}

TEST(MappedFile, PagesThatCannotBeReadAreZerosAndReported) {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/file", other = folder.path() + "/other";
  const std::string content = SampleBytes(4 * kPage);
  WriteFile(path, content);
  WriteFile(other, content);
  const int status = RunChild([&] {
    SurviveUnreadablePages();
    for (int round = 0; round < 3; ++round) {  // ranges are used again
      WriteFile(path, content);
      const auto blob = MustMap(path, content.size()), whole = MustMap(other, content.size());
      std::filesystem::resize_file(path, kPage);
      std::string expected = content;
      std::fill(expected.begin() + kPage, expected.end(), '\0');
      if (AsString(blob->bytes()) != expected) return 1;
      if (!absl::IsDataLoss(blob->Check())) return 2;
      if (!absl::StrContains(blob->Check().message(), path)) return 3;
      if (AsString(whole->bytes()) != content || !whole->Check().ok()) return 4;
    }
    return 0;
  });
  EXPECT_EQ(status, 0);
}

TEST(MappedFile, OtherBusErrorsEndTheProcessAsBefore) {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/file";
  WriteFile(path, SampleBytes(kPage));
  const int status = RunChild([&] {
    signal(SIGBUS, SIG_DFL);  // a sanitizer has a handler of its own
    SurviveUnreadablePages();
    const auto file = base::OpenFile(path, O_RDONLY);
    const void* const start = mmap(nullptr, kPage, PROT_READ, MAP_SHARED, file->fd(), 0);
    std::filesystem::resize_file(path, 0);
    return static_cast<const volatile char*>(start)[0] == 0 ? 1 : 2;
  });
  EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGBUS) << status;
}

}  // namespace
}  // namespace liquidblend::store
