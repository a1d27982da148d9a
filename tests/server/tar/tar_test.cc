#include "server/tar/tar.h"

#include <fstream>
#include <sstream>

#include "tests/core/store/store_testing.h"

namespace liquidblend::tar {
namespace {

using store::AsBytes;
using store::Fails;
using store::Succeeds;
using testing::ElementsAre;
using testing::Pair;

using Files = std::vector<std::pair<std::string, std::string>>;

std::string Archive(const Files& files) {
  std::ostringstream out;
  TarWriter writer(out);
  for (const auto& [name, content] : files) {
    EXPECT_THAT(writer.Add(name, AsBytes(content)), Succeeds());
  }
  EXPECT_THAT(writer.End(), Succeeds());
  return out.str();
}

absl::StatusOr<Files> ReadArchive(const std::string& bytes) {
  std::istringstream in(bytes);
  TarReader reader(in);
  Files files;
  while (true) {
    absl::StatusOr<std::optional<TarEntry>> entry = reader.Next();
    if (!entry.ok()) return entry.status();
    if (!entry->has_value()) return files;
    files.emplace_back((*entry)->name, "");
    const absl::Status status = reader.Read([&](auto content) {
      files.back().second += store::AsString(content);
      return absl::OkStatus();
    });
    if (!status.ok()) return status;
  }
}

TEST(Tar, GivesBackFilesOfAnySize) {
  Files files;
  for (const size_t size : {size_t{0}, size_t{1}, size_t{511}, size_t{512}, size_t{2500000}}) {
    files.emplace_back(absl::StrCat("folder/file", size), store::SampleBytes(size));
  }
  const auto read = ReadArchive(Archive(files));
  ASSERT_THAT(read, Succeeds());
  EXPECT_TRUE(*read == files);
}

TEST(Tar, PassesOverWhatNobodyReads) {
  std::istringstream in(Archive({{"a", store::SampleBytes(1000)}, {"b", "water"}}));
  TarReader reader(in);
  EXPECT_EQ((*reader.Next())->name, "a");
  EXPECT_EQ((*reader.Next())->name, "b");
  EXPECT_FALSE(reader.Next()->has_value());
}

// Written and read by the system's own tar, with folders and "./" in front.
TEST(Tar, IsWhatTarMakesAndReads) {
  const store::TemporaryFolder folder;
  const std::string path = folder.path();
  std::filesystem::create_directories(path + "/in/blobs");
  store::WriteFile(path + "/in/blobs/x", store::SampleBytes(3000));
  for (const std::string format : {"gnu", "ustar", "pax"}) {
    const std::string make = "tar -C " + path + "/in --format=" + format + " -cf " + path + "/t .";
    ASSERT_EQ(std::system(make.c_str()), 0);
    const auto files = ReadArchive(store::ReadFile(path + "/t"));
    ASSERT_THAT(files, Succeeds());
    EXPECT_THAT(*files, ElementsAre(Pair("blobs/x", store::SampleBytes(3000)))) << format;
  }
  store::WriteFile(path + "/t", Archive({{"out/y", store::SampleBytes(700)}, {"z", ""}}));
  ASSERT_EQ(std::system(("tar -C " + path + " -xf " + path + "/t").c_str()), 0);
  EXPECT_TRUE(store::ReadFile(path + "/out/y") == store::SampleBytes(700));
  EXPECT_TRUE(std::filesystem::exists(path + "/z"));
}

TEST(Tar, NoticesWhereItBreaksOff) {
  const std::string whole = Archive({{"a", store::SampleBytes(1000)}, {"b", "water"}});
  for (const size_t size : {size_t{512}, size_t{1100}, size_t{1600}, size_t{2049}}) {
    EXPECT_THAT(ReadArchive(whole.substr(0, size)),
                Fails(absl::StatusCode::kDataLoss, "Truncated tar archive"))
        << size;
  }
  EXPECT_THAT(ReadArchive(""), Fails(absl::StatusCode::kDataLoss, "empty"));
}

TEST(Tar, NoticesADamagedHeader) {
  std::string damaged = Archive({{"a", store::SampleBytes(1000)}, {"b", "water"}});
  damaged[512 + 1024] ^= 1;  // the second header
  EXPECT_THAT(ReadArchive(damaged), Fails(absl::StatusCode::kDataLoss, "Damaged tar archive"));
}

TEST(Tar, RefusesWhatIsNoArchive) {
  for (const std::string& bytes : {store::SampleBytes(100), store::SampleBytes(5000)}) {
    EXPECT_THAT(ReadArchive(bytes), Fails(absl::StatusCode::kInvalidArgument, "not a tar archive"));
  }
}

TEST(Tar, SaysThatTheStreamTakesNoMore) {
  std::ofstream full("/dev/full");
  TarWriter writer(full);
  absl::Status status = writer.Add("a", AsBytes(store::SampleBytes(100'000)));
  if (status.ok()) status = writer.End();
  EXPECT_THAT(status, Fails(absl::StatusCode::kUnavailable, "cannot be written"));
}

}  // namespace
}  // namespace liquidblend::tar
