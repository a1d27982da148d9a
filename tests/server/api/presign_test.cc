// Files that clients send to the store themselves, as a server sees them.
#include <memory>
#include <string>
#include <vector>

#include "core/store/blobs/content_hash.h"
#include "core/store/blobs/http_client.h"
#include "core/store/blobs/s3_blob_store.h"
#include "server/api/handlers.h"
#include "server/api/upload.h"
#include "tests/core/store/blobs/fake_s3.h"
#include "tests/server/backends_testing.h"

namespace liquidblend::server {
namespace {

using store::Fails;
using store::Succeeds;
using testing::ElementsAre;
using Code = absl::StatusCode;

class PresignTest : public RpcTest {
 protected:
  PresignTest() {
    store::S3Options options;
    options.endpoint = options.client_endpoint = s3_.endpoint();
    options.access_key_id = "id";
    options.secret_access_key = "secret";
    options.cache_directory = folder_.path() + "/cache";
    options.part_bytes = 1024;
    options.max_attempts = 2;
    options.first_pause = options.longest_pause = absl::Milliseconds(1);
    urls_ = *store::OpenS3BlobStore("s3://bucket/store", options);
    backends_ = std::make_unique<Backends>(*catalog_, *urls_, families_, SmallBackends());
  }

  static v1::PresignUploadRequest RequestFor(const std::vector<std::string>& contents) {
    v1::PresignUploadRequest request;
    for (const std::string& content : contents) {
      store::BlobHasher hasher;
      hasher.Add(store::AsBytes(content));
      v1::PresignUploadRequest::File& file = *request.add_files();
      file.set_size_bytes(static_cast<int64_t>(content.size()));
      file.set_checksum(hasher.Id());
    }
    return request;
  }

  // So that the store that signs has them, too.
  void CopyToUrls(const std::vector<store::BlobId>& ids) {
    for (const store::BlobId& id : ids) {
      const auto blob = blobs_->Open(id);
      ASSERT_THAT(blob, Succeeds());
      EXPECT_THAT(store::PutBlobAs(*urls_, id, (*blob)->bytes()), Succeeds());
    }
  }

  int Put(const v1::PresignUploadResponse::File& file, const std::string& content) {
    store::HttpRequest request;
    request.method = "PUT";
    request.url = file.part_urls(0);
    request.body = store::AsBytes(content);
    const auto answers = http_.Run({&request, 1});
    EXPECT_THAT(answers.front(), Succeeds());
    return answers.front().ok() ? answers.front()->status : 0;
  }

  static v1::UploadAnimationRequest FileMessage(const std::string& name, int64_t size_bytes,
                                                const std::string& blob) {
    v1::UploadAnimationRequest message;
    message.mutable_file()->set_name(name);
    message.mutable_file()->set_size_bytes(size_bytes);
    message.mutable_file()->set_blob(blob);
    return message;
  }

  static v1::UploadAnimationRequest HeaderMessage(const std::string& id) {
    v1::UploadAnimationRequest message;
    message.mutable_header()->set_animation_id(id);
    return message;
  }

  // What comes of one file that was sent.
  absl::Status NameFile(int64_t size_bytes, const std::string& blob) {
    Upload upload({*catalog_, *urls_, tally_}, SmallLimits());
    EXPECT_THAT(upload.Add(HeaderMessage("drop")), Succeeds());
    return upload.Add(FileMessage("f1.ply", size_bytes, blob));
  }

  store::FakeS3 s3_;
  std::unique_ptr<store::BlobStore> urls_;
  UploadTally tally_;
  std::unique_ptr<Backends> backends_;
  store::HttpClient http_{store::HttpOptions()};
};

TEST_F(PresignTest, FilesThatWereSentBecomeAnImport) {
  const auto urls = PresignUpload(*backends_, RequestFor({"water", "wine"}));
  ASSERT_THAT(urls, Succeeds());
  ASSERT_EQ(urls->files_size(), 2);
  EXPECT_GT(urls->expire_time().seconds(), absl::ToUnixSeconds(absl::Now()));
  EXPECT_EQ(Put(urls->files(0), "water"), 200);
  EXPECT_EQ(Put(urls->files(1), "wine"), 200);
  Upload upload({*catalog_, *urls_, tally_}, SmallLimits());
  ASSERT_THAT(upload.Add(HeaderMessage("drop")), Succeeds());
  ASSERT_THAT(upload.Add(FileMessage("f1.ply", 5, urls->files(0).blob())), Succeeds());
  ASSERT_THAT(upload.Add(FileMessage("f2.ply", 4, urls->files(1).blob())), Succeeds());
  const auto job = upload.Submit();
  ASSERT_THAT(job, Succeeds());
  const store::pb::SourceFile& file = job->import_animation().files(1);
  EXPECT_EQ(file.name(), "f2.ply");
  EXPECT_EQ(file.size_bytes(), 4);
  EXPECT_EQ(store::AsString((*urls_->Open(file.blob()))->bytes()), "wine");
  EXPECT_EQ(catalog_->ListReferencedBlobs()->size(), 2);  // nobody collects them
}

TEST_F(PresignTest, FilesAreTakenByTheNamesOfEarlierClients) {
  v1::PresignUploadRequest request = RequestFor({"water"});
  store::BlobHasher hasher(store::HashKind::kXxh3_128);
  hasher.Add(store::AsBytes("water"));
  request.mutable_files(0)->set_checksum(hasher.Id());
  const auto urls = PresignUpload(*backends_, request);
  ASSERT_THAT(urls, Succeeds());
  const std::string& blob = urls->files(0).blob();
  EXPECT_THAT(blob, testing::StartsWith("xxh3-"));
  EXPECT_EQ(Put(urls->files(0), "water"), 200);
  EXPECT_THAT(NameFile(5, blob), Succeeds());
  EXPECT_EQ(store::AsString((*urls_->Open(blob))->bytes()), "water");
  const auto other = PresignUpload(*backends_, request);
  ASSERT_THAT(other, Succeeds());
  EXPECT_EQ(Put(other->files(0), "wrong"), 200);
  EXPECT_THAT(urls_->Open(other->files(0).blob()), Fails(Code::kDataLoss, "damaged"));
}

TEST_F(PresignTest, AFileMustBeThereAsItIsNamed) {
  const auto urls = PresignUpload(*backends_, RequestFor({"water"}));
  ASSERT_THAT(urls, Succeeds());
  const std::string& blob = urls->files(0).blob();
  EXPECT_THAT(NameFile(5, blob), Fails(Code::kInvalidArgument, "'f1.ply' has not been sent"));
  EXPECT_EQ(Put(urls->files(0), "water"), 200);
  EXPECT_THAT(NameFile(5, blob), Succeeds());
  EXPECT_THAT(NameFile(6, blob), Fails(Code::kInvalidArgument, "5 bytes were sent, not 6"));
  // Only what was sent so: no blob of anyone else, and no other object.
  const store::BlobId other = *store::PutBlob(*urls_, store::AsBytes("secret"));
  for (const std::string& name : {other, blob + "/..", std::string("../") + blob}) {
    EXPECT_THAT(NameFile(6, name), Fails(Code::kInvalidArgument, "file.blob"));
  }
  // No chunks follow.
  Upload upload({*catalog_, *urls_, tally_}, SmallLimits());
  ASSERT_THAT(upload.Add(HeaderMessage("drop")), Succeeds());
  ASSERT_THAT(upload.Add(FileMessage("f1.ply", 5, blob)), Succeeds());
  v1::UploadAnimationRequest chunk;
  chunk.set_chunk("x");
  EXPECT_THAT(upload.Add(chunk), Fails(Code::kInvalidArgument, "chunk"));
}

TEST_F(PresignTest, RequestsAreCheckedBeforeAnythingIsSent) {
  const auto blamed = [&](const v1::PresignUploadRequest& request) {
    const absl::Status status = PresignUpload(*backends_, request).status();
    EXPECT_EQ(status.code(), Code::kInvalidArgument);
    return BlamedFields(status);
  };
  EXPECT_THAT(blamed({}), ElementsAre("files"));
  EXPECT_THAT(blamed(RequestFor(std::vector<std::string>(101))), ElementsAre("files"));
  v1::PresignUploadRequest request = RequestFor({"a", "b"});
  request.mutable_files(0)->set_size_bytes(-1);
  request.mutable_files(1)->set_checksum("md5");
  EXPECT_THAT(blamed(request), ElementsAre("files[0].size_bytes", "files[1].checksum"));
  request = RequestFor({"a"});
  request.set_animation_id("NO");
  EXPECT_THAT(blamed(request), ElementsAre("animation_id"));
  ImportAnimation("a");
  request.set_animation_id("a");
  EXPECT_THAT(PresignUpload(*backends_, request), Fails(Code::kAlreadyExists, "animations/a"));
  request = RequestFor({"a"});
  request.mutable_files(0)->set_size_bytes(1001);
  EXPECT_EQ(ReasonOf(PresignUpload(*backends_, request).status()), "UPLOAD_TOO_LARGE");
}

// Multipart uploads that nobody completes would stay in the bucket.
TEST_F(PresignTest, ARefusedRequestLeavesNoUploadOpen) {
  BackendsOptions options = SmallBackends();
  options.limits.max_upload_bytes = int64_t{1} << 40;
  Backends backends(*catalog_, *urls_, families_, options);
  v1::PresignUploadRequest request = RequestFor(std::vector<std::string>(11));
  for (v1::PresignUploadRequest::File& file : *request.mutable_files()) {
    file.set_size_bytes(100 * 1024);
  }
  EXPECT_EQ(BlamedFields(PresignUpload(backends, request).status()),
            std::vector<std::string>{"files"});
  EXPECT_EQ(s3_.Count("create upload"), 0);

  request.mutable_files()->RemoveLast();
  using Fault = store::FakeS3::Fault;
  s3_.Plan("create upload",
           {Fault::kNone, Fault::kNone, Fault::kStatus500, Fault::kStatus500, Fault::kStatus500});
  EXPECT_THAT(PresignUpload(backends, request), Fails(Code::kUnavailable, "500"));
  EXPECT_EQ(s3_.Count("abort upload"), 2);
  EXPECT_EQ(s3_.NumOpenUploads(), 0);

  s3_.Plan("create upload", {});
  const auto urls = PresignUpload(backends, request);
  ASSERT_THAT(urls, Succeeds());
  int num_urls = 0;
  for (const v1::PresignUploadResponse::File& file : urls->files()) {
    num_urls += file.part_urls_size();
  }
  EXPECT_EQ(num_urls, 1000);
  EXPECT_EQ(s3_.NumOpenUploads(), 10);
}

// Files that are sent and never imported would belong to nobody.
TEST_F(PresignTest, PromisedFilesCountUntilTheyAreImported) {
  Caller ann;
  ann.principal.name = ann.principal.key = "ann";
  ann.principal.limits.max_stored_bytes = 9;
  const auto ask_for_more = [&] {
    return ReasonOf(PresignUpload(*backends_, RequestFor({"water"}), ann).status());
  };
  const auto urls = PresignUpload(*backends_, RequestFor({"water"}), ann);
  ASSERT_THAT(urls, Succeeds());
  EXPECT_EQ(ask_for_more(), "STORED_BYTES_EXCEEDED");
  EXPECT_EQ(Put(urls->files(0), "water"), 200);
  for (const bool is_submitted : {false, true}) {
    Upload upload({*catalog_, *urls_, backends_->uploads}, SmallLimits(), ann);
    ASSERT_THAT(upload.Add(HeaderMessage("drop")), Succeeds());
    ASSERT_THAT(upload.Add(FileMessage("f1.ply", 5, urls->files(0).blob())), Succeeds());
    EXPECT_EQ(ask_for_more(), "STORED_BYTES_EXCEEDED");
    if (is_submitted) {
      ASSERT_THAT(upload.Submit(), Succeeds());
    }
  }
  EXPECT_EQ(backends_->uploads.Add("ann", 0), 0);  // the catalog counts it
  EXPECT_EQ(ask_for_more(), "STORED_BYTES_EXCEEDED");
}

TEST_F(PresignTest, ARefusedRequestPromisesNothing) {
  Caller ann;
  ann.principal.name = ann.principal.key = "ann";
  ann.principal.limits.max_stored_bytes = 9;
  EXPECT_EQ(ReasonOf(PresignUpload(*backends_, RequestFor({"water", "water"}), ann).status()),
            "STORED_BYTES_EXCEEDED");
  EXPECT_EQ(backends_->uploads.Add("ann", 0), 0);
  Caller unlimited;
  unlimited.principal.name = unlimited.principal.key = "ben";
  EXPECT_THAT(PresignUpload(*backends_, RequestFor({"water"}), unlimited), Succeeds());
  EXPECT_EQ(backends_->uploads.Add("ben", 0), 0);  // nobody asks
}

TEST_F(PresignTest, WhatThePrincipalMayStoreCounts) {
  Caller ann;
  ann.principal.name = ann.principal.key = "ann";
  ann.principal.limits.max_stored_bytes = 5;
  EXPECT_THAT(PresignUpload(*backends_, RequestFor({"water"}), ann), Succeeds());
  EXPECT_EQ(ReasonOf(PresignUpload(*backends_, RequestFor({"water", "x"}), ann).status()),
            "STORED_BYTES_EXCEEDED");
}

TEST_F(PresignTest, StoredFilesHaveUrls) {
  const store::BlobId blob = *store::PutBlob(*urls_, store::AsBytes("an animation"));
  SubmitImport("a");
  v1::PresignDownloadRequest request;
  request.set_name("animations/a");
  EXPECT_THAT(PresignDownload(*backends_, request),
              Fails(Code::kFailedPrecondition, "no file yet"));
  store::pb::AnimationRecord animation;
  animation.set_id("a");
  animation.set_blob(blob);
  animation.set_size_bytes(12);
  ASSERT_THAT(catalog_->PublishAnimation(TakeJob().lease_id, animation), Succeeds());
  const auto download = PresignDownload(*backends_, request);
  ASSERT_THAT(download, Succeeds());
  EXPECT_EQ(download->checksum(), blob);
  EXPECT_EQ(download->size_bytes(), 12);
  store::HttpRequest get;
  get.url = download->url();
  EXPECT_EQ(http_.Run({&get, 1}).front()->body, "an animation");
  request.set_name("families/none");
  EXPECT_THAT(PresignDownload(*backends_, request), Fails(Code::kNotFound, "none"));
  request.set_name("operations/a");
  EXPECT_THAT(BlamedFields(PresignDownload(*backends_, request).status()), ElementsAre("name"));
}

TEST_F(PresignTest, FilesOfKeptVersionsHaveUrls) {
  keep_versions_ = 2;
  PublishSplash();
  const store::BlobId first = catalog_->GetFamily("splash")->blob();
  PublishFamily("splash", "a", "b", 2);
  const store::BlobId second = catalog_->GetFamily("splash")->blob();
  ASSERT_NE(first, second);
  CopyToUrls({first, second});
  v1::PresignDownloadRequest request;
  request.set_name("families/splash");
  for (const int64_t version : {0, 1, 2}) {
    request.set_version(version);
    const auto download = PresignDownload(*backends_, request);
    ASSERT_THAT(download, Succeeds()) << version;
    EXPECT_EQ(download->version(), version == 1 ? 1 : 2);
    EXPECT_EQ(download->checksum(), version == 1 ? first : second);
  }
  request.set_version(3);
  EXPECT_THAT(PresignDownload(*backends_, request),
              Fails(Code::kNotFound, "has no version 3; the published one is 2, and kept are 1"));
  request.set_version(-1);
  EXPECT_THAT(BlamedFields(PresignDownload(*backends_, request).status()), ElementsAre("version"));
  request.set_name("animations/a");
  request.set_version(1);
  EXPECT_THAT(BlamedFields(PresignDownload(*backends_, request).status()), ElementsAre("version"));
}

TEST_F(PresignTest, AnIdAloneNamesTheOnlyOneThatHasIt) {
  PublishSplash();
  PublishFamily("a", "a", "b");
  CopyToUrls({catalog_->GetFamily("splash")->blob()});
  v1::PresignDownloadRequest request;
  request.set_name("splash");
  ASSERT_THAT(PresignDownload(*backends_, request), Succeeds());
  EXPECT_EQ(PresignDownload(*backends_, request)->version(), 1);
  request.set_name("b");
  EXPECT_THAT(PresignDownload(*backends_, request),
              Fails(Code::kFailedPrecondition, "animations/b has no file yet"));
  request.set_name("a");
  EXPECT_THAT(PresignDownload(*backends_, request),
              Fails(Code::kInvalidArgument,
                    "'a' is an animation and a family: say animations/a or families/a"));
  request.set_name("none");
  EXPECT_THAT(PresignDownload(*backends_, request), Fails(Code::kNotFound, "none"));
}

TEST_F(PresignTest, AStoreOnOneMachineHasNoUrls) {
  Backends backends(*catalog_, *blobs_, families_, SmallBackends());
  EXPECT_THAT(PresignUpload(backends, RequestFor({"water"})),
              Fails(Code::kUnimplemented, "no urls"));
}

}  // namespace
}  // namespace liquidblend::server
