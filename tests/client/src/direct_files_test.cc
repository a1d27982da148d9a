// Files between a client and a real object store (tests/ceph.sh), past a server that signs urls.
#include "client/src/direct_files.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "core/store/blobs/content_hash.h"
#include "core/store/blobs/s3_blob_store.h"
#include "server/grpc/server.h"
#include "tests/core/store/blobs/ceph_environment.h"
#include "tests/server/backends_testing.h"

namespace liquidblend {
namespace {

using store::Fails;
using store::Succeeds;
using Code = absl::StatusCode;

class DirectFilesTest : public server::RpcTest {
 protected:
  DirectFilesTest() {
    for (const std::string& line : store::CephEnvironment()) {
      const size_t equals = line.find('=');
      setenv(line.substr(0, equals).c_str(), line.substr(equals + 1).c_str(), 1);
    }
  }

  // A server whose clients reach the object store at that endpoint, and a client of it.
  void Start(const std::string& client_endpoint, bool direct_transfers = true) {
    store::S3Options options;
    options.client_endpoint = client_endpoint;
    options.cache_directory = folder_.path() + "/cache";
    options.part_bytes = int64_t{5} << 20;
    const std::string url =
        "s3://liquidblend/" + folder_.path().substr(folder_.path().rfind('/') + 1);
    s3_ = *store::OpenS3BlobStore(url, options);
    server::ServerOptions server;
    server.listen = "127.0.0.1:0";
    server_ = *server::Server::Start(*catalog_, *s3_, families_, server);
    ConnectOptions connect;
    connect.target = absl::StrCat("127.0.0.1:", server_->port());
    connect.direct_transfers = direct_transfers;
    connect.retry.max_attempts = 2;
    client_ = *Client::Connect(connect);
  }

  static std::string Endpoint() { return getenv("AWS_ENDPOINT_URL"); }

  std::string Write(const std::string& name, const std::string& content) {
    const std::string path = absl::StrCat(folder_.path(), "/", name);
    store::WriteFile(path, content);
    return path;
  }

  // The files of the import that an upload of these makes.
  std::vector<store::pb::SourceFile> Upload(const std::vector<std::string>& paths) {
    UploadProgress last;
    const auto operation =
        client_->UploadAnimation({.animation = "drop", .files = paths, .options = {}},
                                 [&](const UploadProgress& progress) { last = progress; });
    EXPECT_THAT(operation, Succeeds());
    EXPECT_EQ(last.bytes_sent, last.bytes_total);
    EXPECT_EQ(last.files_sent, static_cast<int>(paths.size()));
    const store::Lease lease = TakeJob();
    const auto& files = lease.job.import_animation().files();
    return {files.begin(), files.end()};
  }

  // The server keeps a copy in its cache of what it sends to the store.
  bool WentByTheServer(const store::pb::SourceFile& file) const {
    EXPECT_TRUE(store::IsUploadId(file.blob()));
    return std::filesystem::exists(
        store::LocalBlobPath(folder_.path() + "/cache", store::ContentIdOf(file.blob())));
  }

  std::string ContentOf(const store::pb::SourceFile& file) {
    const auto blob = s3_->Open(file.blob());
    EXPECT_THAT(blob, Succeeds());
    return blob.ok() ? store::AsString((*blob)->bytes()) : "";
  }

  std::unique_ptr<store::BlobStore> s3_;
  std::unique_ptr<server::Server> server_;
  std::unique_ptr<Client> client_;
};

TEST_F(DirectFilesTest, FilesGoStraightToTheStore) {
  Start(Endpoint());
  const std::string large((size_t{5} << 20) * 2 + 7, 'x');  // in three parts
  const auto files =
      Upload({Write("f_1.ply", "water"), Write("f_2.ply", large), Write("f_3.ply", "")});
  ASSERT_EQ(files.size(), 3);
  for (const store::pb::SourceFile& file : files) EXPECT_FALSE(WentByTheServer(file));
  EXPECT_EQ(ContentOf(files[0]), "water");
  EXPECT_TRUE(ContentOf(files[1]) == large);
  EXPECT_EQ(ContentOf(files[2]), "");
  EXPECT_EQ(s3_->List()->size(), 3);
  // A second one of that name is refused before anything is sent.
  EXPECT_THAT(client_->UploadAnimation(
                  {.animation = "drop", .files = {Write("f_4.ply", "wine")}, .options = {}}),
              Fails(Code::kAlreadyExists, "animations/drop"));
  EXPECT_EQ(s3_->List()->size(), 3);
}

TEST_F(DirectFilesTest, FilesGoByTheServerWhereTheStoreIsOutOfReach) {
  Start("http://127.0.0.1:1");
  const auto files = Upload({Write("f_1.ply", "water")});
  EXPECT_TRUE(WentByTheServer(files[0]));
  EXPECT_EQ(ContentOf(files[0]), "water");
}

TEST_F(DirectFilesTest, FilesGoByTheServerIfItGivesNoUrls) {
  Start("");
  EXPECT_TRUE(WentByTheServer(Upload({Write("f_1.ply", "water")})[0]));
}

TEST_F(DirectFilesTest, AClientMayDoWithout) {
  Start(Endpoint(), /*direct_transfers=*/false);
  EXPECT_TRUE(WentByTheServer(Upload({Write("f_1.ply", "water")})[0]));
}

TEST_F(DirectFilesTest, StoredFilesAreGotAndChecked) {
  Start(Endpoint());
  const store::BlobId blob = *store::PutBlob(*s3_, store::AsBytes("an animation"));
  SubmitImport("a");
  store::pb::AnimationRecord animation;
  animation.set_id("a");
  animation.set_blob(blob);
  animation.set_size_bytes(12);
  ASSERT_THAT(catalog_->PublishAnimation(TakeJob().lease_id, animation), Succeeds());
  const std::string path = folder_.path() + "/a.file";
  const auto size = client_->Download("animations/a", path);
  ASSERT_THAT(size, Succeeds());
  EXPECT_EQ(*size, 12);
  EXPECT_EQ(store::ReadFile(path), "an animation");

  v1::PresignDownloadResponse wrong;
  wrong.set_url(*s3_->PresignDownload(blob, absl::Minutes(15)));
  wrong.set_size_bytes(12);
  client::Http http("", client::HttpHosts::kAny);
  const std::string other = folder_.path() + "/b.file";
  for (const std::string& checksum :
       {"sha256-" + std::string(64, '0'), "xxh3-" + std::string(32, '0')}) {
    wrong.set_checksum(checksum);
    EXPECT_THAT(client::GetFromUrl(http, wrong, other),
                Fails(Code::kDataLoss, "instead of " + checksum));
    EXPECT_FALSE(std::filesystem::exists(other));
    EXPECT_FALSE(std::filesystem::exists(other + ".part"));
  }
  for (const int wrong_size : {11, 13}) {
    wrong.set_checksum(blob);
    wrong.set_size_bytes(wrong_size);
    EXPECT_THAT(client::GetFromUrl(http, wrong, other),
                Fails(Code::kDataLoss,
                      wrong_size == 11 ? "more than the 11 bytes" : "1 bytes are missing"));
    EXPECT_FALSE(std::filesystem::exists(other));
  }
  wrong.set_size_bytes(12);
  // Of an older store.
  store::BlobHasher hasher(store::HashKind::kXxh3_128);
  hasher.Add(store::AsBytes("an animation"));
  wrong.set_checksum(hasher.Id());
  EXPECT_THAT(client::GetFromUrl(http, wrong, other), Succeeds());
}

TEST_F(DirectFilesTest, StoredFilesComeThroughTheServerIfItGivesNoUrls) {
  Start("");
  const std::string content(3 * (size_t{1} << 20) + 17, 'w');  // four parts
  const store::BlobId blob = *store::PutBlob(*s3_, store::AsBytes(content));
  SubmitImport("a");
  store::pb::AnimationRecord animation;
  animation.set_id("a");
  animation.set_blob(blob);
  ASSERT_THAT(catalog_->PublishAnimation(TakeJob().lease_id, animation), Succeeds());
  const std::string path = folder_.path() + "/a.file";
  const auto size = client_->Download("animations/a", path);
  ASSERT_THAT(size, Succeeds());
  EXPECT_EQ(*size, static_cast<int64_t>(content.size()));
  EXPECT_TRUE(store::ReadFile(path) == content);
  EXPECT_THAT(client_->Download("animations/a", folder_.path() + "/none/a.file"),
              Fails(Code::kPermissionDenied, "none/a.file.part: cannot be written"));
  EXPECT_THAT(client_->Download("animations/none", path), Fails(Code::kNotFound, "none"));
}

}  // namespace
}  // namespace liquidblend
