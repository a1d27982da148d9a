// Files on their way past the server: between client and radosgw, by urls that the server signs.
#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "absl/strings/strip.h"
#include "core/store/blobs/s3_blob_store.h"
#include "core/store/open_store.h"
#include "liquidblend/client.h"
#include "server/admin/collect.h"
#include "server/admin/transfer.h"
#include "tests/core/store/blobs/ceph_environment.h"
#include "tests/e2e/e2e_testing.h"

namespace liquidblend::e2e {
namespace {

class DirectTest : public E2eTest {
 protected:
  DirectTest() {
    for (const std::string& line : store::CephEnvironment()) {
      absl::string_view value = line;
      if (absl::ConsumePrefix(&value, "AWS_ENDPOINT_URL=")) endpoint_ = std::string(value);
      const size_t equals = line.find('=');
      setenv(line.substr(0, equals).c_str(), line.substr(equals + 1).c_str(), 1);
    }
    std::filesystem::create_directories(frames_);
    for (const NamedBytes& file : BallFiles(1.0)) {
      store::WriteFile(frames_ + "/" + file.name, file.bytes);
      ++num_files_;
    }
  }

  std::unique_ptr<Client> MustConnect(bool direct_transfers = true) {
    ConnectOptions options;
    options.target = Address();
    options.direct_transfers = direct_transfers;
    options.retry.max_attempts = 2;
    auto client = Client::Connect(options);
    EXPECT_TRUE(client.ok()) << client.status();
    return *std::move(client);
  }

  // Uploads the ball, whose files must go that way, and waits until it is imported.
  enum class Way { kDirect, kByTheServer };
  void Import(Client& client, const std::string& id, Way way) {
    UploadRequest request;
    request.animation = id;
    request.files = *ListAnimationFiles(frames_);
    UploadProgress last;
    const int64_t num_before = NumUploads(), num_cached_before = NumCachedUploads();
    const auto operation =
        client.UploadAnimation(request, [&](const UploadProgress& progress) { last = progress; });
    ASSERT_TRUE(operation.ok()) << operation.status();
    EXPECT_EQ(last.bytes_sent, last.bytes_total);
    EXPECT_EQ(last.files_sent, num_files_);
    EXPECT_EQ(NumUploads() - num_before, num_files_);
    EXPECT_EQ(NumCachedUploads() - num_cached_before, way == Way::kDirect ? 0 : num_files_);
    const Process worker = StartWorker();
    ExpectSuccess(AwaitDone(operation->name));
  }

  // Downloads animation "a", directly or through the server.
  void ExpectDownload(Client& client) {
    const std::string path = data() + "/a.lbanim";
    const auto size = client.Download("animations/a", path);
    ASSERT_TRUE(size.ok()) << size.status();
    EXPECT_EQ(*size, client.GetAnimation("a")->size_bytes);
    EXPECT_EQ(static_cast<int64_t>(std::filesystem::file_size(path)), *size);
    EXPECT_FALSE(std::filesystem::exists(path + ".part"));
  }

  std::unique_ptr<store::BlobStore> OpenBlobs() {
    store::S3Options options;
    options.cache_directory = data() + "/another-cache";
    const std::vector<std::string> arguments = StoreArguments();
    const auto flag = std::find(arguments.begin(), arguments.end(), "--blobs");
    auto blobs = store::OpenS3BlobStore(*(flag + 1), options);
    EXPECT_TRUE(blobs.ok()) << blobs.status();
    return *std::move(blobs);
  }

  // Files of uploads that are in the store.
  int64_t NumUploads() {
    const std::vector<store::BlobInfo> list = *OpenBlobs()->List();
    return std::count_if(list.begin(), list.end(),
                         [](const store::BlobInfo& blob) { return store::IsUploadId(blob.id); });
  }

  // Those of which the server has a copy: they came by it, if no worker has opened them.
  int64_t NumCachedUploads() {
    const std::vector<store::BlobInfo> list = *OpenBlobs()->List();
    return std::count_if(list.begin(), list.end(), [&](const store::BlobInfo& blob) {
      return store::IsUploadId(blob.id) && std::filesystem::exists(store::LocalBlobPath(
                                               blob_folder(), store::ContentIdOf(blob.id)));
    });
  }

  const std::string frames_ = data() + "/frames";
  int num_files_ = 0;
  std::string endpoint_;
};

TEST_F(DirectTest, FilesGoStraightToTheStoreAndComeFromThere) {
  const Process server = StartServer(0, {"LIQUIDBLEND_CLIENT_S3=" + endpoint_});
  const auto client = MustConnect();
  Import(*client, "a", Way::kDirect);

  ExpectDownload(*client);
  const std::string path = data() + "/none.lbanim";
  EXPECT_EQ(client->Download("animations/none", path).status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(client
                ->UploadAnimation(
                    {.animation = "a", .files = *ListAnimationFiles(frames_), .options = {}})
                .status()
                .code(),
            absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(NumUploads(), num_files_);  // refused before anything was sent

  Import(*MustConnect(/*direct_transfers=*/false), "b", Way::kByTheServer);
}

TEST_F(DirectTest, KeptVersionsComeFromTheStoreByTheirNumber) {
  const Process server = StartServer(1, {"LIQUIDBLEND_CLIENT_S3=" + endpoint_});
  for (const auto& [id, velocity] : {std::pair("a", 1.0), {"b", 2.0}, {"c", 3.0}}) {
    ExpectSuccess(AwaitDone(ImportBall(id, velocity).name()));
  }
  for (const std::string target : {"b", "c"}) {
    Operation registration;
    ASSERT_TRUE(Register(1, registration, {target}).ok());
    ExpectSuccess(AwaitDone(registration.name()));
  }
  const auto client = MustConnect();
  const auto download = [&](int64_t version) {
    const std::string path = absl::StrCat(data(), "/family-", version);
    const auto size = client->Download("families/balls", path, version);
    EXPECT_TRUE(size.ok()) << size.status();
    return store::ReadFile(path);
  };
  const std::string first = download(1), second = download(2);
  EXPECT_NE(first, second);
  EXPECT_EQ(download(0), second);
  EXPECT_EQ(client->Download("families/balls", data() + "/none", 3).status().code(),
            absl::StatusCode::kNotFound);
}

// While their import waits: nobody collects them, and elsewhere they are blobs like all others.
TEST_F(DirectTest, WhatWaitsForItsImportIsKeptAndExported) {
  const Process server = StartServer(0, {"LIQUIDBLEND_CLIENT_S3=" + endpoint_});
  UploadRequest request;
  request.animation = "a";
  request.files = *ListAnimationFiles(frames_);
  ASSERT_TRUE(MustConnect()->UploadAnimation(request).ok());
  const store::Store from = {OpenCatalog(), OpenBlobs(), "here"};
  const auto collected =
      admin::Collect(*from.catalog, *from.blobs, {.older_than = absl::ZeroDuration()});
  ASSERT_TRUE(collected.ok()) << collected.status();
  EXPECT_EQ(collected->num_deleted, 0);
  EXPECT_EQ(NumUploads(), num_files_);

  const parallel::Arena arena(1);
  admin::Progress progress(admin::Progress::Style::kNone);
  const std::string folder = data() + "/export";
  const auto exported = admin::ExportToDirectory(from, folder, arena, progress);
  ASSERT_TRUE(exported.ok()) << exported.status();
  store::StoreLocation location;
  location.data = data() + "/elsewhere";
  const store::Store to = *store::OpenStore(location);
  const auto imported = admin::ImportFromDirectory(folder, to, arena, progress);
  ASSERT_TRUE(imported.ok()) << imported.status();
  const store::pb::JobRecord job = to.catalog->ListJobs(1, "")->records.front();
  ASSERT_EQ(job.import_animation().files_size(), num_files_);
  for (const store::pb::SourceFile& file : job.import_animation().files()) {
    const auto blob = to.blobs->Open(file.blob());
    ASSERT_TRUE(blob.ok()) << blob.status();
    EXPECT_EQ(store::AsString((*blob)->bytes()), store::ReadFile(frames_ + "/" + file.name()));
  }
}

TEST_F(DirectTest, FilesGoByTheServerWhereTheStoreIsOutOfReach) {
  const Process server = StartServer(0, {"LIQUIDBLEND_CLIENT_S3=http://127.0.0.1:1"});
  const auto client = MustConnect();
  Import(*client, "a", Way::kByTheServer);
  ExpectDownload(*client);
}

TEST_F(DirectTest, FilesGoByTheServerUnlessItOffersUrls) {
  const Process server = StartServer(0);
  const auto client = MustConnect();
  Import(*client, "a", Way::kByTheServer);
  ExpectDownload(*client);
}

}  // namespace
}  // namespace liquidblend::e2e
