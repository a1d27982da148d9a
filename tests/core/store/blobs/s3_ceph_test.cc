// The blob store's suite against a real object store: tests/ceph.sh, which ctest starts before.
#include <algorithm>
#include <cstdlib>

#include "absl/strings/str_split.h"
#include "absl/time/clock.h"
#include "core/store/blobs/content_hash.h"
#include "core/store/blobs/http_client.h"
#include "core/store/blobs/s3_blob_store.h"
#include "core/store/blobs/s3_client.h"
#include "tests/core/store/blobs/blob_store_suite.h"
#include "tests/core/store/blobs/ceph_environment.h"

namespace liquidblend::store {
namespace {

S3Options CephOptions() {
  for (const std::string& line : CephEnvironment()) {
    const std::pair<std::string, std::string> variable = absl::StrSplit(line, '=');
    setenv(variable.first.c_str(), variable.second.c_str(), 1);
  }
  S3Options options;
  options.part_bytes = int64_t{5} << 20;
  return options;
}

// A prefix of its own; each handle has its own cache.
class CephBackend : public BlobBackend {
 public:
  std::unique_ptr<BlobStore> Open() override {
    options_.cache_directory = absl::StrCat(folder_.path(), "/cache", num_handles_++);
    auto blobs = OpenS3BlobStore(url_, options_);
    EXPECT_THAT(blobs, Succeeds());
    return blobs.ok() ? *std::move(blobs) : nullptr;
  }

  void Damage(const BlobId& id) override {
    const std::string key = BlobKey(id);
    options_.cache_directory = folder_.path() + "/unused";
    const auto s3 = S3Client::Make(url_, options_);
    ASSERT_THAT(s3, Succeeds());
    const auto object = (*s3)->Find(key);
    ASSERT_THAT(object, Succeeds());
    const S3Client::Range whole = {0, object->size_bytes};
    auto content = (*s3)->Get(key, {&whole, 1});
    ASSERT_THAT(content, Succeeds());
    std::string& bytes = content->front();
    bytes[bytes.size() / 2] ^= 0x10;
    EXPECT_THAT((*s3)->Put(key, AsBytes(bytes)), Succeeds());
    for (int k = 0; k < num_handles_; ++k) {
      std::filesystem::remove(LocalBlobPath(absl::StrCat(folder_.path(), "/cache", k), id));
    }
  }

 private:
  TemporaryFolder folder_;
  S3Options options_ = CephOptions();
  // Characters that signatures and lists have to encode.
  const std::string url_ = "s3://liquidblend/" +
                           folder_.path().substr(folder_.path().rfind('/') + 1) +
                           "/a b+c&d=\xc3\xa4";
  int num_handles_ = 0;
};

INSTANTIATE_TEST_SUITE_P(Ceph, BlobStoreSuite,
                         ::testing::Values([]() -> std::unique_ptr<BlobBackend> {
                           return std::make_unique<CephBackend>();
                         }));

// S3Client recognises an object whose completion it has not heard of by this.
TEST(S3Ceph, ObjectsOfSeveralPartsHaveTheEtagOfTheirParts) {
  TemporaryFolder folder;
  S3Options options = CephOptions();
  options.cache_directory = folder.path();
  const auto s3 = S3Client::Make("s3://liquidblend" + folder.path(), options);
  ASSERT_THAT(s3, Succeeds());
  const auto part_bytes = static_cast<size_t>(options.part_bytes);
  const std::string content = SampleBytes(2 * part_bytes + 7);
  ASSERT_THAT((*s3)->Put("key", AsBytes(content)), Succeeds());
  std::vector<std::string> parts;
  for (size_t k = 0; k < 3; ++k) {
    const std::string part = content.substr(k * part_bytes, part_bytes);
    parts.push_back(Md5Hex(AsBytes(part)));
  }
  const auto object = (*s3)->Find("key");
  ASSERT_THAT(object, Succeeds());
  EXPECT_EQ(object->etag, EtagOfParts(parts));
  EXPECT_THAT((*s3)->Delete("key"), Succeeds());
}

TEST(S3Ceph, SendsAndGetsLargeBlobsInParts) {
  CephBackend backend;
  const std::string content = SampleBytes((size_t{5} << 20) * 5 + 7);
  const auto id = PutBlob(*backend.Open(), AsBytes(content));
  ASSERT_THAT(id, Succeeds());
  const auto blob = backend.Open()->Open(*id);
  ASSERT_THAT(blob, Succeeds());
  EXPECT_TRUE(AsString((*blob)->bytes()) == content);
  EXPECT_EQ(backend.Open()->List()->size(), 1);
}

// ---- what clients send and get themselves

class S3CephDirect : public ::testing::Test {
 protected:
  S3CephDirect() {
    CephOptions();
    options_.cache_directory = folder_.path() + "/cache";
    options_.client_endpoint = getenv("AWS_ENDPOINT_URL");
    options_.part_bytes = int64_t{5} << 20;
    blobs_ = *OpenS3BlobStore(url_, options_);
  }

  HttpAnswer Send(const std::string& method, const std::string& url, const std::string& body,
                  const std::map<std::string, std::string>& headers = {}) {
    HttpRequest request;
    request.method = method;
    request.url = url;
    request.body = AsBytes(body);
    for (const auto& [name, value] : headers) request.headers.emplace_back(name, value);
    std::vector<absl::StatusOr<HttpAnswer>> answers = http_.Run({&request, 1});
    EXPECT_THAT(answers.front(), Succeeds());
    return answers.front().ok() ? *answers.front() : HttpAnswer();
  }

  DirectUpload MustPresign(const std::string& content, const std::string& sent) {
    BlobHasher hasher;
    hasher.Add(AsBytes(content));
    const auto upload =
        blobs_->PresignUpload(hasher.Id(), static_cast<int64_t>(sent.size()), absl::Minutes(15));
    EXPECT_THAT(upload, Succeeds());
    return upload.ok() ? *upload : DirectUpload();
  }

  TemporaryFolder folder_;
  S3Options options_;
  const std::string url_ =
      "s3://liquidblend/" + folder_.path().substr(folder_.path().rfind('/') + 1) + "/a b+c";
  std::unique_ptr<BlobStore> blobs_;
  HttpClient http_{HttpOptions()};
};

TEST_F(S3CephDirect, AFileThatAClientSendsIsOpenedByItsName) {
  const DirectUpload upload = MustPresign("water", "water");
  ASSERT_TRUE(IsUploadId(upload.id));
  ASSERT_EQ(upload.part_urls.size(), 1);
  EXPECT_TRUE(upload.complete_url.empty());
  EXPECT_THAT(blobs_->Open(upload.id), Fails(absl::StatusCode::kNotFound, "uploads/"));
  EXPECT_THAT(blobs_->SizeOfUpload(upload.id), Fails(absl::StatusCode::kNotFound, "uploads/"));
  ASSERT_EQ(Send("PUT", upload.part_urls[0], "water", upload.headers).status, 200);
  EXPECT_EQ(*blobs_->SizeOfUpload(upload.id), 5);
  const auto blob = blobs_->Open(upload.id);
  ASSERT_THAT(blob, Succeeds());
  EXPECT_EQ(AsString((*blob)->bytes()), "water");
  EXPECT_THAT(blobs_->Verify(upload.id), Succeeds());
  // It is there for collectors, and goes like any other.
  ASSERT_EQ(blobs_->List()->size(), 1);
  EXPECT_EQ(blobs_->List()->front().id, upload.id);
  EXPECT_FALSE(*blobs_->DeleteIfNotNewer(upload.id, absl::UnixEpoch()));
  EXPECT_TRUE(*blobs_->DeleteIfNotNewer(upload.id, absl::InfiniteFuture()));
  EXPECT_TRUE(blobs_->List()->empty());
}

TEST_F(S3CephDirect, WhatAClientHasSentCannotBeReplaced) {
  const DirectUpload upload = MustPresign("water", "water");
  ASSERT_EQ(Send("PUT", upload.part_urls[0], "water", upload.headers).status, 200);
  EXPECT_EQ(Send("PUT", upload.part_urls[0], "flood", upload.headers).status, 412);
  EXPECT_EQ(Send("PUT", upload.part_urls[0], "flood").status, 403) << "without If-None-Match";
  EXPECT_THAT(blobs_->Verify(upload.id), Succeeds());
}

TEST_F(S3CephDirect, AUrlIsGoodForItsRequestAlone) {
  const DirectUpload upload = MustPresign("water", "water");
  const std::string& url = upload.part_urls[0];
  EXPECT_EQ(Send("PUT", url, "more water", upload.headers).status, 403) << "another size";
  EXPECT_EQ(Send("GET", url, "").status, 403);
  EXPECT_EQ(Send("DELETE", url, "", upload.headers).status, 403);
  std::string other = url;
  other.replace(other.find(upload.id), 9, "sha256-00");
  EXPECT_EQ(Send("PUT", other, "water", upload.headers).status, 403) << "another key";
  EXPECT_TRUE(blobs_->List()->empty());
}

TEST_F(S3CephDirect, AUrlExpires) {
  const BlobId id = *PutBlob(*blobs_, AsBytes("water"));
  const std::string url = *blobs_->PresignDownload(id, absl::Seconds(1));
  const absl::Time deadline = absl::Now() + absl::Seconds(30);
  while (Send("GET", url, "").status == 200) ASSERT_LT(absl::Now(), deadline);
  EXPECT_EQ(Send("GET", url, "").status, 403);
}

TEST_F(S3CephDirect, WhatIsNotAsItsSenderSaidIsNotOpened) {
  const DirectUpload upload = MustPresign("water", "blood");
  ASSERT_EQ(Send("PUT", upload.part_urls[0], "blood", upload.headers).status, 200);
  EXPECT_THAT(blobs_->Open(upload.id), Fails(absl::StatusCode::kDataLoss, "is damaged"));
  // A cached blob of the promised content may stand in for it, never the other way round.
  const BlobId blob = *PutBlob(*blobs_, AsBytes("water"));
  const auto opened = blobs_->Open(upload.id);
  ASSERT_THAT(opened, Succeeds());
  EXPECT_EQ(AsString((*opened)->bytes()), "water");
  EXPECT_EQ(AsString((*blobs_->Open(blob))->bytes()), "water");
  EXPECT_THAT(blobs_->Verify(upload.id), Fails(absl::StatusCode::kDataLoss, "is damaged"));
}

TEST_F(S3CephDirect, LargeFilesAreSentInParts) {
  const std::string content = SampleBytes((size_t{5} << 20) * 2 + 7);
  const DirectUpload upload = MustPresign(content, content);
  ASSERT_EQ(upload.part_urls.size(), 3);
  std::string list = "<CompleteMultipartUpload>";
  for (size_t k = 0; k < 3; ++k) {
    const auto begin = k * static_cast<size_t>(upload.part_bytes);
    const HttpAnswer answer =
        Send("PUT", upload.part_urls[k],
             content.substr(begin, static_cast<size_t>(upload.part_bytes)), upload.headers);
    ASSERT_EQ(answer.status, 200) << answer.body;
    absl::StrAppend(&list, "<Part><PartNumber>", k + 1, "</PartNumber><ETag>",
                    answer.headers.at("etag"), "</ETag></Part>");
  }
  list += "</CompleteMultipartUpload>";
  EXPECT_THAT(blobs_->Open(upload.id), Fails(absl::StatusCode::kNotFound, "uploads/"));
  ASSERT_EQ(Send("POST", upload.complete_url, list).status, 200);
  const auto blob = blobs_->Open(upload.id);
  ASSERT_THAT(blob, Succeeds());
  EXPECT_TRUE(AsString((*blob)->bytes()) == content);
}

TEST_F(S3CephDirect, UploadsInPartsThatAreLeftCanBeEnded) {
  const std::string large(size_t{12} << 20, 'x');
  for (int k = 0; k < 2; ++k) EXPECT_EQ(MustPresign(large, large).part_urls.size(), 3);
  EXPECT_EQ(*blobs_->DropOldUploads(absl::Now() - absl::Hours(1)), 0);
  EXPECT_EQ(*blobs_->DropOldUploads(absl::Now() + absl::Hours(1)), 2);
  EXPECT_EQ(*blobs_->DropOldUploads(absl::Now() + absl::Hours(1)), 0);
}

TEST_F(S3CephDirect, BlobsCanBeGotByTheirUrl) {
  const BlobId id = *PutBlob(*blobs_, AsBytes("water"));
  const HttpAnswer answer = Send("GET", *blobs_->PresignDownload(id, absl::Minutes(15)), "");
  EXPECT_EQ(answer.status, 200);
  EXPECT_EQ(answer.body, "water");
  EXPECT_THAT(blobs_->PresignDownload("xxh3-00000000000000000000000000000000", absl::Minutes(1)),
              Fails(absl::StatusCode::kNotFound, "xxh3-0000"));
}

TEST_F(S3CephDirect, UrlsAreGivenOnlyWhereTheyAreOffered) {
  options_.client_endpoint.clear();
  const auto closed = *OpenS3BlobStore(url_, options_);
  const BlobId id = *PutBlob(*closed, AsBytes("water"));
  EXPECT_THAT(closed->PresignUpload(id, 5, absl::Minutes(15)),
              Fails(absl::StatusCode::kUnimplemented, "no urls"));
  EXPECT_THAT(closed->PresignDownload(id, absl::Minutes(15)),
              Fails(absl::StatusCode::kUnimplemented, "no urls"));
  options_.client_endpoint = "s3.example.org";
  EXPECT_THAT(OpenS3BlobStore(url_, options_),
              Fails(absl::StatusCode::kInvalidArgument, "'s3.example.org'"));
}

TEST(S3Ceph, SaysWhoRefusesWhat) {
  const TemporaryFolder folder;
  S3Options options = CephOptions();
  options.cache_directory = folder.path();
  EXPECT_THAT(OpenS3BlobStore("s3://no-such-bucket/x", options),
              Fails(absl::StatusCode::kPermissionDenied, "NoSuchBucket"));
  options.access_key_id = getenv("AWS_ACCESS_KEY_ID");
  options.secret_access_key = "wrong";
  const auto refused = OpenS3BlobStore("s3://liquidblend/x", options);
  ASSERT_THAT(refused, Succeeds());
  EXPECT_THAT((*refused)->List(),
              Fails(absl::StatusCode::kPermissionDenied, "SignatureDoesNotMatch"));
}

}  // namespace
}  // namespace liquidblend::store
