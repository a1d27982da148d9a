#include <sys/resource.h>
#include <sys/stat.h>

#include <csignal>

#include "tests/core/store/blobs/blob_store_suite.h"

namespace liquidblend::store {
namespace {

namespace fs = std::filesystem;

std::string PathOf(const std::string& directory, const BlobId& id) {
  return absl::StrCat(directory, "/blobs/", id.substr(id.find('-') + 1, 2), "/", id);
}

std::unique_ptr<BlobStore> MustOpen(const std::string& directory) {
  auto blobs = OpenLocalBlobStore(directory);
  EXPECT_THAT(blobs, Succeeds());
  return blobs.ok() ? *std::move(blobs) : nullptr;
}

class LocalBackend : public BlobBackend {
 public:
  std::unique_ptr<BlobStore> Open() override { return MustOpen(folder_.path()); }
  void Damage(const BlobId& id) override {
    const std::string path = PathOf(folder_.path(), id);
    std::string content = ReadFile(path);
    content[content.size() / 2] ^= 0x10;
    WriteFile(path, content);
  }

 private:
  TemporaryFolder folder_;
};

INSTANTIATE_TEST_SUITE_P(Local, BlobStoreSuite,
                         ::testing::Values([]() -> std::unique_ptr<BlobBackend> {
                           return std::make_unique<LocalBackend>();
                         }));

// The process is killed in the middle of putting a blob; returns what a reader then sees.
std::vector<BlobInfo> AfterDeathAt(const std::string& fault_point, const std::string& directory,
                                   const std::string& content) {
  EXPECT_TRUE(DiesAt(fault_point, [&] {
    const auto blobs = OpenLocalBlobStore(directory);
    if (blobs.ok()) PutBlob(**blobs, AsBytes(content)).IgnoreError();
  }));
  const auto infos = MustOpen(directory)->List();
  EXPECT_THAT(infos, Succeeds());
  return *infos;
}

TEST(LocalBlobStore, ShowsNothingOfAWriterKilledBeforeTheRename) {
  for (const std::string point : {"blob.append", "blob.before_sync", "blob.before_rename"}) {
    const TemporaryFolder folder;
    EXPECT_TRUE(AfterDeathAt(point, folder.path(), SampleBytes(100000)).empty()) << point;
    EXPECT_EQ(CountFiles(folder.path()), 0) << point;  // the left-over is removed on opening
    EXPECT_THAT(PutBlob(*MustOpen(folder.path()), AsBytes("water")), Succeeds());
  }
}

TEST(LocalBlobStore, HasTheWholeBlobOfAWriterKilledAfterTheRename) {
  for (const std::string point : {"blob.after_rename", "blob.committed"}) {
    const TemporaryFolder folder;
    const std::string content = SampleBytes(100000);
    const std::vector<BlobInfo> infos = AfterDeathAt(point, folder.path(), content);
    ASSERT_EQ(infos.size(), 1) << point;
    const auto blob = MustOpen(folder.path())->Open(infos[0].id);
    ASSERT_THAT(blob, Succeeds());
    EXPECT_TRUE(AsString((*blob)->bytes()) == content);
    EXPECT_EQ(CountFiles(folder.path()), 1) << point;
  }
}

TEST(LocalBlobStore, KeepsTheTemporaryFileOfALiveWriterOnOpening) {
  const TemporaryFolder folder;
  const auto blobs = MustOpen(folder.path());
  auto writer = blobs->Create();
  ASSERT_THAT(writer, Succeeds());
  ASSERT_THAT((*writer)->Append(AsBytes("half")), Succeeds());
  MustOpen(folder.path());
  EXPECT_TRUE(WIFEXITED(RunChild([&] { return OpenLocalBlobStore(folder.path()).ok() ? 0 : 1; })));
  EXPECT_EQ(CountFiles(folder.path() + "/tmp"), 1);
  EXPECT_THAT((*writer)->Commit(), Succeeds());
  EXPECT_EQ(CountFiles(folder.path() + "/tmp"), 0);
}

TEST(LocalBlobStore, WritersAndOpenersDoNotDisturbEachOther) {
  const TemporaryFolder folder;
  std::vector<pid_t> children;
  for (int child = 0; child < 4; ++child) {
    children.push_back(StartChild([&] {
      for (int k = 0; k < 20; ++k) {
        const auto blobs = OpenLocalBlobStore(folder.path());
        const std::string content = absl::StrCat(child, " ", k);
        if (!blobs.ok() || !PutBlob(**blobs, AsBytes(content)).ok()) return 1;
      }
      return 0;
    }));
  }
  for (const pid_t child : children) EXPECT_EQ(WaitFor(child), 0);
  EXPECT_EQ(MustOpen(folder.path())->List()->size(), 80);
  EXPECT_EQ(CountFiles(folder.path() + "/tmp"), 0);
}

TEST(LocalBlobStore, NamesThePathWhenTheFileCannotGrow) {
  const TemporaryFolder folder;
  const int status = RunChild([&] {
    signal(SIGXFSZ, SIG_IGN);
    const rlimit limit = {100000, 100000};
    setrlimit(RLIMIT_FSIZE, &limit);
    const auto blobs = OpenLocalBlobStore(folder.path());
    if (!blobs.ok()) return 1;
    auto writer = (*blobs)->Create();
    if (!writer.ok()) return 2;
    const absl::Status full = (*writer)->Append(AsBytes(SampleBytes(200000)));
    if (!absl::IsResourceExhausted(full)) return 3;
    if (!absl::StrContains(full.message(), folder.path() + "/tmp/")) return 4;
    return (*writer)->Commit().status() == full ? 0 : 5;
  });
  EXPECT_EQ(status, 0);
  EXPECT_TRUE(MustOpen(folder.path())->List()->empty());
  EXPECT_EQ(CountFiles(folder.path()), 0);
}

TEST(LocalBlobStore, NamesThePathItMayNotRead) {
  const TemporaryFolder folder;
  const auto id = PutBlob(*MustOpen(folder.path()), AsBytes("water"));
  ASSERT_THAT(id, Succeeds());
  const std::string path = PathOf(folder.path(), *id);
  const auto blobs = MustOpen(folder.path());
  ASSERT_EQ(chmod(path.c_str(), 0), 0);
  const int status = RunChild([&] {
    if (geteuid() == 0 && setuid(65534) != 0) return 1;  // root may read everything
    const absl::Status denied = blobs->Open(*id).status();
    return absl::IsPermissionDenied(denied) && absl::StrContains(denied.message(), path) ? 0 : 2;
  });
  EXPECT_EQ(status, 0);
}

TEST(LocalBlobStore, NamesTheFolderItCannotMake) {
  const TemporaryFolder folder;
  WriteFile(folder.path() + "/file", "in the way");
  EXPECT_THAT(OpenLocalBlobStore(folder.path() + "/file"),
              Fails(absl::StatusCode::kUnavailable, folder.path() + "/file"));
}

TEST(LocalBlobStore, NoticesATruncatedBlobAndOneThatIsNoFile) {
  const TemporaryFolder folder;
  const auto blobs = MustOpen(folder.path());
  const auto id = PutBlob(*blobs, AsBytes(SampleBytes(5000)));
  ASSERT_THAT(id, Succeeds());
  const std::string path = PathOf(folder.path(), *id);
  fs::permissions(path, fs::perms(0644));
  fs::resize_file(path, 4999);
  EXPECT_THAT(blobs->Open(*id), Fails(absl::StatusCode::kDataLoss, path));
  fs::remove(path);
  fs::create_directory(path);
  EXPECT_THAT(blobs->Open(*id), Fails(absl::StatusCode::kDataLoss, path));
}

TEST(LocalBlobStore, LeavesABlobThatIsThereAsItIs) {
  const TemporaryFolder folder;
  const auto blobs = MustOpen(folder.path());
  const BlobId id = *PutBlob(*blobs, AsBytes("water"));
  struct stat before, after;
  ASSERT_EQ(stat(PathOf(folder.path(), id).c_str(), &before), 0);
  EXPECT_EQ(*PutBlob(*MustOpen(folder.path()), AsBytes("water")), id);
  ASSERT_EQ(stat(PathOf(folder.path(), id).c_str(), &after), 0);
  EXPECT_EQ(before.st_ino, after.st_ino);
  EXPECT_EQ(CountFiles(folder.path()), 1);
}

TEST(LocalBlobStore, MovesADamagedBlobAsideBeforeItIsPutAgain) {
  const TemporaryFolder folder;
  const auto blobs = MustOpen(folder.path());
  const BlobId id = *PutBlob(*blobs, AsBytes("water"));
  WriteFile(PathOf(folder.path(), id), "wafer");
  EXPECT_EQ(*PutBlob(*blobs, AsBytes("water")), id);
  EXPECT_EQ(AsString((*blobs->Open(id))->bytes()), "water");
  const fs::path aside = *fs::directory_iterator(folder.path() + "/quarantine");
  EXPECT_TRUE(absl::StartsWith(aside.filename().string(), id));
  EXPECT_EQ(ReadFile(aside), "wafer");
}

TEST(LocalBlobStore, PuttingABlobAgainRenewsItsTime) {
  const TemporaryFolder folder;
  const auto blobs = MustOpen(folder.path());
  const auto id = PutBlob(*blobs, AsBytes("water"));
  ASSERT_THAT(id, Succeeds());
  const std::string path = PathOf(folder.path(), *id);
  fs::last_write_time(path, fs::last_write_time(path) - std::chrono::hours(100));
  EXPECT_LT(blobs->List()->front().modified, absl::Now() - absl::Hours(99));
  EXPECT_THAT(PutBlob(*blobs, AsBytes("water")), Succeeds());
  EXPECT_GT(blobs->List()->front().modified, absl::Now() - absl::Hours(1));
}

// Whoever deletes what is old and whoever commits it again at that moment: the commit counts.
TEST(LocalBlobStore, KeepsWhatIsCommittedWhileItIsBeingDeletedAsOld) {
  const TemporaryFolder folder;
  const auto blobs = *OpenLocalBlobStore(folder.path());
  const auto other = *OpenLocalBlobStore(folder.path());
  const BlobId id = *PutBlob(*blobs, AsBytes("water"));
  const auto long_ago = std::filesystem::file_time_type::clock::now() - std::chrono::hours(48);
  const absl::Time yesterday = absl::Now() - absl::Hours(24);
  for (int round = 0; round < 300; ++round) {
    std::filesystem::last_write_time(LocalBlobPath(folder.path(), id), long_ago);
    std::thread collector([&] { other->DeleteIfNotNewer(id, yesterday).IgnoreError(); });
    ASSERT_THAT(PutBlob(*blobs, AsBytes("water")), Succeeds());
    collector.join();
    ASSERT_THAT(blobs->Open(id), Succeeds()) << "round " << round;
  }
}

TEST(LocalBlobStore, IsAsOldAsItsCommit) {
  const TemporaryFolder folder;
  const auto blobs = *OpenLocalBlobStore(folder.path());
  const auto writer = *blobs->Create();
  ASSERT_THAT(writer->Append(AsBytes("water")), Succeeds());
  const std::string temporary =
      std::filesystem::directory_iterator(folder.path() + "/tmp")->path().string();
  std::filesystem::last_write_time(
      temporary, std::filesystem::file_time_type::clock::now() - std::chrono::hours(48));
  ASSERT_THAT(writer->Commit(), Succeeds());
  EXPECT_GT(blobs->List()->front().modified, absl::Now() - absl::Minutes(1));
}

TEST(LocalBlobStore, WritesBlobsReadOnly) {
  const TemporaryFolder folder;
  const auto id = PutBlob(*MustOpen(folder.path()), AsBytes("water"));
  ASSERT_THAT(id, Succeeds());
  const fs::perms mode = fs::status(PathOf(folder.path(), *id)).permissions();
  EXPECT_EQ(mode & fs::perms(0222), fs::perms::none);
}

}  // namespace
}  // namespace liquidblend::store
