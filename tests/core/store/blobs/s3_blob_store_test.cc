// What the S3 blob store does when S3 does not do what it should. The suite that every blob store
// passes runs against a real one in s3_ceph_test.cc.
#include "core/store/blobs/s3_blob_store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <thread>

#include "absl/time/clock.h"
#include "core/store/blobs/content_hash.h"
#include "core/store/blobs/http_client.h"
#include "core/store/blobs/mapped_file.h"
#include "tests/core/store/blobs/fake_s3.h"
#include "tests/core/store/store_testing.h"

namespace liquidblend::store {
namespace {

using Code = absl::StatusCode;
using Fault = FakeS3::Fault;
using ::testing::HasSubstr;
using ::testing::Not;

class S3BlobStoreTest : public ::testing::Test {
 protected:
  S3BlobStoreTest() {
    options_.endpoint = s3_.endpoint();
    options_.access_key_id = "key";
    options_.secret_access_key = "secret";
    options_.first_pause = absl::Milliseconds(1);
    options_.longest_pause = absl::Milliseconds(4);
    options_.part_bytes = int64_t{5} << 20;
    blobs_ = MustOpen();
  }

  // With a cache of its own.
  std::unique_ptr<BlobStore> MustOpen() {
    options_.cache_directory = absl::StrCat(folder_.path(), "/cache", num_caches_++);
    auto blobs = OpenS3BlobStore("s3://bucket/some/prefix", options_);
    EXPECT_THAT(blobs, Succeeds());
    return blobs.ok() ? *std::move(blobs) : nullptr;
  }

  BlobId MustPut(const std::string& content) {
    const auto id = PutBlob(*blobs_, AsBytes(content));
    EXPECT_THAT(id, Succeeds());
    return id.ok() ? *id : BlobId();
  }

  static std::string NameOf(const BlobId& id) {
    return "s3://bucket/some/prefix/blobs/" + id.substr(id.find('-') + 1, 2) + "/" + id;
  }

  FakeS3 s3_;
  TemporaryFolder folder_;
  S3Options options_;
  int num_caches_ = 0;
  std::unique_ptr<BlobStore> blobs_;
};

TEST_F(S3BlobStoreTest, NamesWhatIsWrongWithUrlAndOptions) {
  for (const std::string url : {"", "s3://", "s3:///prefix", "http://bucket/prefix", "bucket"}) {
    EXPECT_THAT(OpenS3BlobStore(url, options_),
                Fails(Code::kInvalidArgument, "s3://bucket/prefix"));
  }
  S3Options options = options_;
  options.num_parallel = 0;
  EXPECT_THAT(OpenS3BlobStore("s3://bucket", options),
              Fails(Code::kInvalidArgument, "num_parallel is out of range: 0"));
  options = options_;
  options.cache_directory = "";
  EXPECT_THAT(OpenS3BlobStore("s3://bucket", options),
              Fails(Code::kInvalidArgument, "cache_directory"));
  EXPECT_THAT(OpenS3BlobStore("s3://elsewhere/x", options_),
              Fails(Code::kPermissionDenied, "s3://elsewhere: HTTP status 404, NoSuchBucket"));
}

TEST_F(S3BlobStoreTest, TakesCredentialsFromTheEnvironment) {
  for (const char* name : {"AWS_ENDPOINT_URL_S3", "AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY"}) {
    unsetenv(name);
  }
  S3Options options;
  options.cache_directory = folder_.path() + "/other";
  setenv("AWS_ENDPOINT_URL", s3_.endpoint().c_str(), 1);
  setenv("AWS_EC2_METADATA_DISABLED", "true", 1);
  EXPECT_THAT(OpenS3BlobStore("s3://bucket", options),
              Fails(Code::kInvalidArgument, "AWS_ACCESS_KEY_ID"));
  setenv("AWS_ACCESS_KEY_ID", "key", 1);
  setenv("AWS_SECRET_ACCESS_KEY", "secret", 1);
  EXPECT_THAT(OpenS3BlobStore("s3://bucket", options), Succeeds());
  for (const char* name : {"AWS_ENDPOINT_URL", "AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY",
                           "AWS_EC2_METADATA_DISABLED"}) {
    unsetenv(name);
  }
}

TEST_F(S3BlobStoreTest, IsOpenedWhileS3RefusesAndServesItsCache) {
  const BlobId id = MustPut("water");
  s3_.SetFault(Fault::kStatus403);
  const auto reopened = OpenS3BlobStore("s3://bucket/some/prefix", options_);  // the same cache
  ASSERT_THAT(reopened, Succeeds());
  EXPECT_THAT((*reopened)->Open(id), Succeeds());
  EXPECT_THAT(MustOpen()->Open(id), Fails(Code::kPermissionDenied, NameOf(id)));
  s3_.SetFault(Fault::kNone);
  EXPECT_THAT(MustOpen()->Open(id), Succeeds());
}

TEST_F(S3BlobStoreTest, UsesTheKeysOfALocalStore) {
  const BlobId id = MustPut("water");
  ASSERT_EQ(s3_.Objects().size(), 1);
  EXPECT_EQ(s3_.Objects().begin()->first,
            "some/prefix/blobs/" + id.substr(id.find('-') + 1, 2) + "/" + id);
  EXPECT_EQ(s3_.Objects().begin()->second, "water");
}

TEST_F(S3BlobStoreTest, TriesAgainWhateverPasses) {
  const std::vector<Fault> faults = {Fault::kStatus500, Fault::kStatus503, Fault::kReset,
                                     Fault::kStatus500, Fault::kStatus503};
  s3_.Plan("PUT", faults);
  const BlobId id = MustPut(SampleBytes(100000));
  EXPECT_EQ(s3_.Count("PUT"), 6);
  const auto other = MustOpen();
  s3_.Plan("HEAD", faults);
  s3_.Plan("GET", {Fault::kStatus500, Fault::kTruncate, Fault::kReset, Fault::kTruncate,
                   Fault::kStatus503});
  const auto blob = other->Open(id);
  ASSERT_THAT(blob, Succeeds());
  EXPECT_TRUE(AsString((*blob)->bytes()) == SampleBytes(100000));
  s3_.Plan("DELETE", faults);
  EXPECT_THAT(other->Delete(id), Succeeds());
  EXPECT_TRUE(s3_.Objects().empty());
}

TEST_F(S3BlobStoreTest, GivesUpAfterTheLastAttemptAndNamesTheKey) {
  const BlobId id = MustPut("water");
  const auto other = MustOpen();
  s3_.Plan("HEAD", std::vector<Fault>(6, Fault::kStatus503));
  EXPECT_THAT(other->Open(id), Fails(Code::kUnavailable, NameOf(id)));
  s3_.Plan("GET", std::vector<Fault>(6, Fault::kReset));
  EXPECT_THAT(other->Open(id), Fails(Code::kUnavailable, NameOf(id)));
  EXPECT_THAT(other->Open(id), Succeeds());
  s3_.Plan("PUT", std::vector<Fault>(6, Fault::kStatus500));
  const absl::Status status = PutBlob(*blobs_, AsBytes("fire")).status();
  EXPECT_THAT(status, Fails(Code::kUnavailable, "HTTP status 500, InternalError"));
  EXPECT_EQ(s3_.Objects().size(), 1);
}

TEST_F(S3BlobStoreTest, DoesNotRepeatWhatIsRefused) {
  s3_.Plan("PUT", {Fault::kStatus403});
  const absl::Status status = PutBlob(*blobs_, AsBytes("water")).status();
  EXPECT_THAT(status, Fails(Code::kPermissionDenied, "PUT s3://bucket/some/prefix/blobs/"));
  EXPECT_THAT(std::string(status.message()), Not(HasSubstr("secret")));
  EXPECT_EQ(s3_.Count("PUT"), 1);
}

TEST_F(S3BlobStoreTest, GetsABlobAgainThatArrivesDamaged) {
  const BlobId id = MustPut(SampleBytes(100000));
  s3_.Plan("GET", {Fault::kNone, Fault::kFlip});  // the first is the list of the new store
  const auto blob = MustOpen()->Open(id);
  ASSERT_THAT(blob, Succeeds());
  EXPECT_TRUE(AsString((*blob)->bytes()) == SampleBytes(100000));
  s3_.Plan("GET", {Fault::kNone, Fault::kFlip, Fault::kFlip});
  EXPECT_THAT(MustOpen()->Open(id), Fails(Code::kDataLoss, NameOf(id) + " is damaged"));
}

TEST_F(S3BlobStoreTest, SendsAndGetsLargeBlobsInParts) {
  const std::string content = SampleBytes((size_t{5} << 20) * 6 + 7);
  s3_.Plan("PUT", {Fault::kNone, Fault::kReset, Fault::kStatus503});
  s3_.Plan("POST", {Fault::kStatus500});
  const BlobId id = MustPut(content);
  EXPECT_EQ(s3_.Count("PUT"), 9);
  EXPECT_EQ(s3_.NumOpenUploads(), 0);
  ASSERT_EQ(s3_.Objects().size(), 1);
  EXPECT_TRUE(s3_.Objects().begin()->second == content);
  s3_.Plan("GET", {Fault::kNone, Fault::kReset, Fault::kTruncate});
  const int before = s3_.Count("GET");
  const auto blob = MustOpen()->Open(id);
  ASSERT_THAT(blob, Succeeds());
  EXPECT_TRUE(AsString((*blob)->bytes()) == content);
  EXPECT_EQ(s3_.Count("GET") - before, 1 + 7 + 2);
}

TEST_F(S3BlobStoreTest, LeavesNoPartsBehindWhenItFails) {
  s3_.Plan("PUT", {Fault::kNone, Fault::kStatus403});
  EXPECT_THAT(PutBlob(*blobs_, AsBytes(SampleBytes(size_t{11} << 20))),
              Fails(Code::kPermissionDenied, "AccessDenied"));
  EXPECT_EQ(s3_.NumOpenUploads(), 0);
  EXPECT_TRUE(s3_.Objects().empty());
}

// A page that cannot be read while a request is repeated is sent as zeros: no record may name them.
TEST_F(S3BlobStoreTest, ACachedFileThatCannotBeReadWhileItIsSentIsReported) {
  SurviveUnreadablePages();
  s3_.Plan("PUT", {Fault::kHang});
  const auto writer = blobs_->Create();
  ASSERT_THAT(writer, Succeeds());
  ASSERT_THAT((*writer)->Append(AsBytes("water")), Succeeds());
  BlobHasher hasher;
  hasher.Add(AsBytes("water"));
  std::jthread disk([&] {
    while (s3_.NumHanging() == 0) absl::SleepFor(absl::Milliseconds(1));
    std::filesystem::resize_file(LocalBlobPath(options_.cache_directory, hasher.Id()), 0);
    s3_.StopHanging();
  });
  EXPECT_THAT((*writer)->Commit(), Fails(Code::kDataLoss, "the disk may be failing"));
  EXPECT_EQ(s3_.Count("PUT"), 2);
}

// Whatever stands between us and S3, a blob is lost only if S3 says so.
TEST_F(S3BlobStoreTest, NoOtherAnswerMeansThatABlobIsLost) {
  const BlobId id = MustPut("water");
  const std::vector<std::pair<Fault, Code>> faults = {
      {Fault::kPlain404, Code::kUnavailable},
      {Fault::kRedirect, Code::kUnavailable},
      {Fault::kNoSuchBucket, Code::kPermissionDenied},
      {Fault::kWrongRegion, Code::kPermissionDenied}};
  for (const auto& [fault, code] : faults) {
    const auto empty = MustOpen();
    s3_.SetFault(fault);
    EXPECT_THAT(empty->Open(id), Fails(code, NameOf(id)));
    EXPECT_THAT(PutBlob(*empty, AsBytes("fire")), Fails(code, "PUT s3://bucket/some/prefix/"));
    EXPECT_THAT(blobs_->Open(id), Succeeds()) << "from the cache";
    EXPECT_THAT(empty->Delete(id), Fails(code, NameOf(id)));
    s3_.SetFault(Fault::kNone);
    EXPECT_THAT(empty->Open(id), Succeeds());
  }
  const auto empty = MustOpen();
  s3_.Plan("HEAD", {Fault::kPlain404});
  EXPECT_THAT(empty->Open(id), Fails(Code::kUnavailable, "but a GET finds the object"));
  EXPECT_THAT(blobs_->Delete(id), Succeeds());
  EXPECT_THAT(empty->Open(id), Fails(Code::kNotFound, "NoSuchKey"));
}

TEST_F(S3BlobStoreTest, AListThatGoesInCirclesIsUnavailable) {
  HttpFake http([](const HttpFake::Request&) {
    return HttpFake::Answer{
        200,
        "<ListBucketResult><NextContinuationToken>again</NextContinuationToken><Contents><Key>"
        "blobs/00/a</Key><LastModified>2026-01-01T00:00:00.000Z</LastModified><Size>1</Size>"
        "</Contents></ListBucketResult>"};
  });
  options_.endpoint = http.url();
  options_.cache_directory = folder_.path() + "/circle";
  const auto blobs = OpenS3BlobStore("s3://bucket", options_);
  ASSERT_THAT(blobs, Succeeds());
  EXPECT_THAT((*blobs)->List(), Fails(Code::kUnavailable, "keys do not ascend"));
}

TEST_F(S3BlobStoreTest, AListOfEmptyPagesEnds) {
  HttpFake http([](const HttpFake::Request&) {
    return HttpFake::Answer{200,
                            "<ListBucketResult><NextContinuationToken>again"
                            "</NextContinuationToken></ListBucketResult>"};
  });
  options_.endpoint = http.url();
  options_.cache_directory = folder_.path() + "/empty";
  const auto blobs = OpenS3BlobStore("s3://bucket", options_);
  ASSERT_THAT(blobs, Succeeds());
  EXPECT_THAT((*blobs)->List(), Fails(Code::kUnavailable, "empty pages"));
}

TEST_F(S3BlobStoreTest, ListsPageByPage) {
  std::vector<BlobId> ids;
  for (int k = 0; k < 10; ++k) ids.push_back(MustPut(absl::StrCat(k)));
  std::sort(ids.begin(), ids.end());
  const auto infos = blobs_->List();
  ASSERT_THAT(infos, Succeeds());
  std::vector<BlobId> listed;
  for (const BlobInfo& info : *infos) listed.push_back(info.id);
  EXPECT_EQ(listed, ids);
  EXPECT_LT(absl::AbsDuration(infos->front().modified - absl::Now()), absl::Hours(1));
}

// ---- the cache

TEST_F(S3BlobStoreTest, GetsABlobOnce) {
  const BlobId id = MustPut("water");
  const auto other = MustOpen();
  EXPECT_THAT(other->Open(id), Succeeds());
  const int num_gets = s3_.Count("GET");
  EXPECT_THAT(other->Open(id), Succeeds());
  EXPECT_THAT(blobs_->Open(id), Succeeds());
  EXPECT_EQ(s3_.Count("GET"), num_gets);
}

TEST_F(S3BlobStoreTest, ServesWhatIsInTheCacheWhileS3CannotBeReached) {
  const BlobId id = MustPut("water");
  s3_.Plan("HEAD", std::vector<Fault>(6, Fault::kStatus503));
  EXPECT_THAT(blobs_->Open(id), Succeeds());
}

TEST_F(S3BlobStoreTest, GetsABlobAgainWhoseCopyIsDamaged) {
  const BlobId id = MustPut("water");
  WriteFile(LocalBlobPath(options_.cache_directory, id), "wafer");
  const auto blob = blobs_->Open(id);
  ASSERT_THAT(blob, Succeeds());
  EXPECT_EQ(AsString((*blob)->bytes()), "water");
}

// A client that sends other bytes of the same XXH3 as a blob of an older store gets neither into
// its place nor into its cached copy.
TEST_F(S3BlobStoreTest, FilesSentDirectlyNeverStandInForABlob) {
  options_.client_endpoint = s3_.endpoint();
  blobs_ = MustOpen();
  const auto [a, b] = CollidingContents();
  BlobHasher hasher(HashKind::kXxh3_128);
  hasher.Add(AsBytes(a));
  const BlobId id = hasher.Id();
  ASSERT_THAT(PutBlobAs(*blobs_, id, AsBytes(a)), Succeeds());
  const auto upload = blobs_->PresignUpload(id, static_cast<int64_t>(b.size()), absl::Minutes(1));
  ASSERT_THAT(upload, Succeeds());
  HttpClient http{HttpOptions()};
  const HttpRequest request = {
      .method = "PUT", .url = upload->part_urls[0], .headers = {}, .body = AsBytes(b)};
  ASSERT_EQ(http.Run({&request, 1})[0]->status, 200);
  for (int round = 0; round < 2; ++round) {
    const auto sent = blobs_->Open(upload->id);
    ASSERT_THAT(sent, Succeeds());
    EXPECT_TRUE(AsString((*sent)->bytes()) == b);
    const auto blob = blobs_->Open(id);
    ASSERT_THAT(blob, Succeeds());
    EXPECT_TRUE(AsString((*blob)->bytes()) == a);
  }
}

TEST_F(S3BlobStoreTest, ForgetsWhatWasNotUsedForTheLongestTime) {
  options_.cache_bytes = 2500;
  blobs_ = MustOpen();
  std::vector<BlobId> ids;
  for (int k = 0; k < 4; ++k) {
    ids.push_back(MustPut(SampleBytes(1000, static_cast<uint32_t>(k))));
    const std::string path = LocalBlobPath(options_.cache_directory, ids.back());
    std::filesystem::last_write_time(
        path, std::filesystem::file_time_type::clock::now() - std::chrono::hours(100 - k));
  }
  const auto open = blobs_->Open(ids[0]);  // used now
  ASSERT_THAT(open, Succeeds());
  MustPut("one more");
  const auto is_cached = [&](const BlobId& id) {
    return std::filesystem::exists(LocalBlobPath(options_.cache_directory, id));
  };
  EXPECT_TRUE(is_cached(ids[0]));
  EXPECT_FALSE(is_cached(ids[1]));
  EXPECT_FALSE(is_cached(ids[2]));
  EXPECT_TRUE(is_cached(ids[3]));
  EXPECT_EQ(blobs_->List()->size(), 5);
  EXPECT_THAT(blobs_->Open(ids[1]), Succeeds());
}

}  // namespace
}  // namespace liquidblend::store
