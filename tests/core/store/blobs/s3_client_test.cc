// Tests of the S3 client: lost answers, refusals, wrong clocks and hanging connections.
#include "core/store/blobs/s3_client.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "absl/time/clock.h"
#include "tests/core/store/blobs/fake_s3.h"
#include "tests/core/store/store_testing.h"

namespace liquidblend::store {
namespace {

using Code = absl::StatusCode;
using Fault = FakeS3::Fault;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr int64_t kPartBytes = 1024;

class S3ClientTest : public ::testing::Test {
 protected:
  S3ClientTest() {
    options_.endpoint = s3_.endpoint();
    options_.access_key_id = "key";
    options_.secret_access_key = "secret";
    options_.cache_directory = folder_.path();  // not used
    options_.first_pause = absl::Milliseconds(1);
    options_.longest_pause = absl::Milliseconds(4);
    options_.part_bytes = kPartBytes;
    Open();
  }

  void Open() {
    auto client = S3Client::Make("s3://bucket/store", options_);
    ASSERT_THAT(client, Succeeds());
    client_ = *std::move(client);
  }

  absl::Status Put(const std::string& content) { return client_->Put("key", AsBytes(content)); }
  std::string Stored() { return s3_.Objects()["store/key"]; }

  FakeS3 s3_;
  TemporaryFolder folder_;
  S3Options options_;
  std::unique_ptr<S3Client> client_;
  const std::string small_ = SampleBytes(100);
  const std::string large_ = SampleBytes(5 * kPartBytes + 7);
};

// ---- answers that are lost after the request was carried out

TEST_F(S3ClientTest, PutWithALostAnswerSucceeds) {
  s3_.Plan("PUT", {Fault::kAnswerLost});
  EXPECT_THAT(Put(small_), Succeeds());
  EXPECT_EQ(Stored(), small_);
}

TEST_F(S3ClientTest, CompletionWithALostAnswerSucceeds) {
  s3_.Plan("complete upload", {Fault::kAnswerLost});
  EXPECT_THAT(Put(large_), Succeeds());
  EXPECT_TRUE(Stored() == large_);
  EXPECT_EQ(s3_.Count("create upload"), 1);
  EXPECT_EQ(s3_.NumOpenUploads(), 0);
}

// An older object of the same bytes is not taken for this upload: its age would not be renewed, and
// a collector could delete it.
TEST_F(S3ClientTest, AnOlderObjectOfTheSameBytesIsNoCompletedUpload) {
  ASSERT_THAT(Put(large_), Succeeds());
  const absl::Time before = client_->Find("key")->modified;
  s3_.SetClockAhead(absl::Hours(10));
  s3_.Plan("complete upload", {Fault::kUploadVanished});
  EXPECT_THAT(Put(large_), Succeeds());
  EXPECT_GT(client_->Find("key")->modified, before + absl::Hours(9));
}

TEST_F(S3ClientTest, CompletionWithALostAnswerSucceedsEvenIfTheLookIsLostToo) {
  s3_.Plan("complete upload", {Fault::kAnswerLost});
  s3_.Plan("HEAD", {Fault::kStatus500, Fault::kReset});
  EXPECT_THAT(Put(large_), Succeeds());
  EXPECT_EQ(s3_.Count("create upload"), 1);
}

TEST_F(S3ClientTest, PartWithALostAnswerIsSentAgain) {
  s3_.Plan("upload part", {Fault::kNone, Fault::kAnswerLost, Fault::kAnswerLost});
  EXPECT_THAT(Put(large_), Succeeds());
  EXPECT_TRUE(Stored() == large_);
}

// DropOldUploads() ends it: to abort it at once could hit another program's upload of the same key.
TEST_F(S3ClientTest, CreationWithALostAnswerLeavesOneOpenUpload) {
  s3_.Plan("create upload", {Fault::kAnswerLost});
  EXPECT_THAT(Put(large_), Succeeds());
  EXPECT_TRUE(Stored() == large_);
  EXPECT_EQ(s3_.NumOpenUploads(), 1);
}

TEST_F(S3ClientTest, AbortWithALostAnswerLeavesNothing) {
  s3_.Plan("upload part", std::vector<Fault>(24, Fault::kStatus500));
  s3_.Plan("abort upload", {Fault::kAnswerLost});
  EXPECT_THAT(Put(large_), Fails(Code::kUnavailable, "InternalError"));
  EXPECT_EQ(s3_.Count("abort upload"), 2);
  EXPECT_EQ(s3_.NumOpenUploads(), 0);
}

TEST_F(S3ClientTest, DeleteWithALostAnswerSucceeds) {
  ASSERT_THAT(Put(small_), Succeeds());
  s3_.Plan("DELETE", {Fault::kAnswerLost});
  EXPECT_THAT(client_->Delete("key"), Succeeds());
  EXPECT_TRUE(s3_.Objects().empty());
}

TEST_F(S3ClientTest, ConditionalDeleteWithALostAnswerLooksAgain) {
  ASSERT_THAT(Put(small_), Succeeds());
  s3_.Plan("DELETE", {Fault::kAnswerLost});
  const auto gone = client_->DeleteIfNotNewer("key", absl::InfiniteFuture());
  ASSERT_THAT(gone, Succeeds());
  EXPECT_TRUE(*gone);
  EXPECT_EQ(s3_.Count("HEAD"), 2);
  EXPECT_EQ(s3_.Count("DELETE"), 1);
}

TEST_F(S3ClientTest, ConditionalDeleteThatFailsLooksBeforeEachAttempt) {
  ASSERT_THAT(Put(small_), Succeeds());
  s3_.Plan("DELETE", {Fault::kReset, Fault::kStatus503});
  const auto gone = client_->DeleteIfNotNewer("key", absl::InfiniteFuture());
  ASSERT_THAT(gone, Succeeds());
  EXPECT_TRUE(*gone);
  EXPECT_EQ(s3_.Count("HEAD"), 3);
}

// ---- multipart uploads that vanish

TEST_F(S3ClientTest, AnUploadThatVanishedBeginsAgain) {
  s3_.Plan("complete upload", {Fault::kUploadVanished});
  EXPECT_THAT(Put(large_), Succeeds());
  EXPECT_TRUE(Stored() == large_);
  s3_.Plan("upload part", {Fault::kNone, Fault::kUploadVanished});
  EXPECT_THAT(Put(large_), Succeeds());
  EXPECT_EQ(s3_.Count("create upload"), 4);
  EXPECT_EQ(s3_.NumOpenUploads(), 0);
}

TEST_F(S3ClientTest, AnotherObjectUnderTheKeyIsNoCompletedUpload) {
  ASSERT_THAT(Put(SampleBytes(large_.size(), 2)), Succeeds());  // of the same size
  s3_.Plan("complete upload", {Fault::kUploadVanished});
  EXPECT_THAT(Put(large_), Succeeds());
  EXPECT_TRUE(Stored() == large_);
  EXPECT_EQ(s3_.Count("create upload"), 3);
}

TEST_F(S3ClientTest, UploadsThatKeepVanishingAreUnavailable) {
  s3_.Plan("complete upload", std::vector<Fault>(100, Fault::kUploadVanished));
  EXPECT_THAT(Put(large_), Fails(Code::kUnavailable, "NoSuchUpload"));
  EXPECT_EQ(s3_.Count("create upload"), options_.max_attempts);
}

// ---- answers that are cut short, though they look whole

TEST_F(S3ClientTest, AnErrorInTheMiddleOfABodyIsMetAgain) {
  ASSERT_THAT(Put(small_), Succeeds());
  s3_.Plan("GET", {Fault::kErrorInBody});
  const std::vector<S3Client::Range> ranges = {{0, 100}};
  const auto got = client_->Get("key", ranges);
  ASSERT_THAT(got, Succeeds());
  EXPECT_TRUE(got->front() == small_);
}

TEST_F(S3ClientTest, AListThatIsCutShortIsNotTakenForAWholeOne) {
  for (const char* key : {"a", "b"}) ASSERT_THAT(client_->Put(key, AsBytes(small_)), Succeeds());
  s3_.Plan("list", {Fault::kErrorInBody});
  const auto page = client_->List("", "");
  ASSERT_THAT(page, Succeeds());
  EXPECT_EQ(page->objects.size(), 2);
  s3_.Plan("list", std::vector<Fault>(6, Fault::kErrorInBody));
  EXPECT_THAT(client_->List("", ""), Fails(Code::kUnavailable, "cut short"));
}

TEST_F(S3ClientTest, ACompletionThatFailsWithinA200IsMetAgain) {
  s3_.Plan("create upload", {Fault::kErrorInBody});
  s3_.Plan("complete upload", {Fault::kErrorInBody});
  EXPECT_THAT(Put(large_), Succeeds());
  EXPECT_TRUE(Stored() == large_);
}

// ---- refusals

TEST_F(S3ClientTest, ARefusalIsNotRepeatedAndTellsNoSecret) {
  for (const Fault fault : {Fault::kStatus403, Fault::kExpiredToken}) {
    s3_.Plan("PUT", {fault});
    const int before = s3_.Count("PUT");
    const absl::Status status = Put(small_);
    EXPECT_THAT(status,
                Fails(Code::kPermissionDenied, "PUT s3://bucket/store/key: HTTP status 403"));
    EXPECT_THAT(std::string(status.message()), Not(HasSubstr("secret")));
    EXPECT_EQ(s3_.Count("PUT") - before, 1);
  }
}

TEST_F(S3ClientTest, ARequestIsSignedAgainWithTheTimeOfS3) {
  for (const absl::Duration ahead : {absl::Hours(1), -absl::Hours(30), absl::ZeroDuration()}) {
    s3_.SetClockAhead(ahead);
    for (int k = 0; k < 2; ++k) {
      const int before = s3_.Count("PUT");
      EXPECT_THAT(Put(small_), Succeeds());
      EXPECT_EQ(s3_.Count("PUT") - before, k == 0 ? 2 : 1) << ahead;
    }
  }
  s3_.SetClockAhead(absl::Hours(2));
  EXPECT_THAT(client_->Find("key"), Succeeds());  // the answer to a HEAD has no code
}

class RotatedCredentialsTest : public S3ClientTest {
 protected:
  RotatedCredentialsTest() {
    for (const char* name : kVariables) unsetenv(name);
    path_ = folder_.path() + "/credentials";
    setenv("AWS_SHARED_CREDENTIALS_FILE", path_.c_str(), 1);
    setenv("AWS_EC2_METADATA_DISABLED", "true", 1);
    options_.access_key_id = options_.secret_access_key = "";
    WriteKeys("first", "token 1");
    Open();
    s3_.SetKeyId("first");
  }
  ~RotatedCredentialsTest() override {
    for (const char* name : kVariables) unsetenv(name);
  }
  void WriteKeys(const std::string& id, const std::string& token) {
    std::ofstream(path_) << "[default]\naws_access_key_id = " << id
                         << "\naws_secret_access_key = hush\naws_session_token = " << token << "\n";
  }
  static constexpr const char* kVariables[] = {
      "AWS_SHARED_CREDENTIALS_FILE", "AWS_PROFILE",       "AWS_ACCESS_KEY_ID",
      "AWS_SECRET_ACCESS_KEY",       "AWS_SESSION_TOKEN", "AWS_EC2_METADATA_DISABLED"};
  std::string path_;
};

TEST_F(RotatedCredentialsTest, AKeyThatWasRotatedIsReadAgain) {
  EXPECT_THAT(Put(large_), Succeeds());
  WriteKeys("second", "token 1");
  s3_.SetKeyId("second");
  EXPECT_THAT(Put(large_), Succeeds());
  EXPECT_THAT(client_->Find("key"), Succeeds());
}

TEST_F(RotatedCredentialsTest, ATokenThatExpiredIsReadAgain) {
  EXPECT_THAT(Put(small_), Succeeds());
  WriteKeys("first", "token 2");
  s3_.ExpireToken("token 1");
  EXPECT_THAT(client_->Find("key"), Succeeds());  // a 400 without a body
  EXPECT_THAT(Put(small_), Succeeds());
}

TEST_F(RotatedCredentialsTest, WithoutNewOnesARequestIsRefusedAtOnce) {
  s3_.ExpireToken("token 1");
  const absl::Status refused = Put(small_);
  EXPECT_THAT(refused, Fails(Code::kPermissionDenied, "HTTP status 400, ExpiredToken"));
  for (const char* secret : {"hush", "token 1"}) {
    EXPECT_THAT(std::string(refused.message()), Not(HasSubstr(secret)));
  }
  EXPECT_EQ(s3_.Count("PUT"), 1);
}

// ---- connections that hang, servers that are too busy

TEST_F(S3ClientTest, AHangingConnectionEndsByItself) {
  options_.connect_timeout = options_.stall_timeout = absl::Milliseconds(300);
  options_.max_attempts = 20;
  Open();
  s3_.Plan("PUT", {Fault::kHang});
  EXPECT_THAT(Put(small_), Succeeds());
  EXPECT_EQ(s3_.NumMet(Fault::kHang), 1);
  options_.max_attempts = 2;
  Open();
  s3_.SetFault(Fault::kHang);
  EXPECT_THAT(Put(small_), Fails(Code::kUnavailable, "no progress for 300ms"));
  s3_.StopHanging();
  options_.max_attempts = 20;
  Open();
  EXPECT_THAT(Put(small_), Succeeds());
}

// A byte now and then keeps a connection from standing still, but not for ever.
TEST_F(S3ClientTest, AnAnswerThatDripsEndsByItself) {
  ASSERT_THAT(Put(SampleBytes(kPartBytes)), Succeeds());
  options_.connect_timeout = options_.stall_timeout = absl::Seconds(2);
  options_.max_attempts = 1;
  Open();
  s3_.Plan("GET", {Fault::kDrip});
  const std::vector<S3Client::Range> ranges = {{0, kPartBytes}};
  EXPECT_THAT(client_->Get("key", ranges), Fails(Code::kUnavailable, "too slow"));
  EXPECT_THAT(client_->Get("key", ranges), Succeeds());
}

// While S3 puts the parts of a large upload together it sends spaces, for minutes: much longer than
// three stall timeouts, and much slower than any transfer may be.
TEST_F(S3ClientTest, ACompletionThatIsKeptAliveBySpacesIsWaitedFor) {
  options_.connect_timeout = options_.stall_timeout = absl::Seconds(1);
  options_.max_attempts = 1;
  options_.complete_timeout = absl::Minutes(1);
  Open();
  s3_.Plan("complete upload", {Fault::kSpaces});  // for four seconds
  EXPECT_THAT(Put(large_), Succeeds());
  EXPECT_EQ(s3_.Count("complete upload"), 1);
  EXPECT_TRUE(Stored() == large_);

  options_.complete_timeout = absl::ZeroDuration();
  Open();
  s3_.Plan("complete upload", {Fault::kSpaces});
  EXPECT_THAT(Put(large_), Fails(Code::kUnavailable, "too slow"));

  // Silence ends it as before.
  options_.complete_timeout = absl::Minutes(1);
  Open();
  s3_.Plan("complete upload", {Fault::kHang});
  EXPECT_THAT(Put(large_), Fails(Code::kUnavailable, "no progress for 1s"));
  s3_.StopHanging();
}

// ---- uploads that were left

TEST_F(S3ClientTest, OldUploadsAreDroppedPageByPage) {
  options_.client_endpoint = options_.endpoint;
  Open();
  const auto begin = [&](const std::string& key) {
    ASSERT_THAT(client_->PresignPut(key, 2 * kPartBytes, absl::Minutes(1)), Succeeds());
  };
  for (int k = 0; k < 7; ++k) begin(absl::StrCat("uploads/", k));
  begin("elsewhere/1");
  s3_.SetClockAhead(absl::Hours(2));
  begin("uploads/young");
  const auto dropped = client_->DropOldUploads("uploads/", absl::Now() + absl::Hours(1));
  ASSERT_THAT(dropped, Succeeds());
  EXPECT_EQ(*dropped, 7);
  EXPECT_EQ(s3_.NumOpenUploads(), 2);
  s3_.Plan("list uploads", {Fault::kStatus403});
  EXPECT_THAT(client_->DropOldUploads("uploads/", absl::Now()),
              Fails(Code::kPermissionDenied, "AccessDenied"));
}

// ---- answers of any size

TEST_F(S3ClientTest, AnAnswerThatIsTooLongIsRefused) {
  ASSERT_THAT(Put(small_), Succeeds());
  const std::string limit = "an answer of more than ";
  s3_.Plan("GET", {Fault::kLongBody});
  EXPECT_THAT(client_->List("", ""), Fails(Code::kResourceExhausted, limit + "16777216 bytes"));
  s3_.Plan("PUT", {Fault::kLongBody});
  EXPECT_THAT(Put(small_), Fails(Code::kResourceExhausted, limit));
  s3_.Plan("GET", {Fault::kLongBody});
  const std::vector<S3Client::Range> ranges = {{0, 100}};
  EXPECT_THAT(client_->Get("key", ranges), Fails(Code::kResourceExhausted, limit + "65536 bytes"));
}

TEST_F(S3ClientTest, HeadersThatAreTooLongAreRefused) {
  ASSERT_THAT(Put(small_), Succeeds());
  s3_.Plan("HEAD", {Fault::kManyHeaders});
  EXPECT_THAT(client_->Find("key"),
              Fails(Code::kResourceExhausted, "headers of more than 262144 bytes"));
  EXPECT_THAT(client_->Find("key"), Succeeds());
}

TEST(S3Options, PausesDoubleAndAreLongerWhenS3AsksToSlowDown) {
  S3Options options;
  EXPECT_EQ(options.PauseAfter(1, false), absl::Milliseconds(100));
  EXPECT_EQ(options.PauseAfter(3, false), absl::Milliseconds(400));
  EXPECT_EQ(options.PauseAfter(1, true), absl::Milliseconds(400));
  EXPECT_EQ(options.PauseAfter(3, true), absl::Milliseconds(1600));
  EXPECT_EQ(options.PauseAfter(100, false), absl::Seconds(5));
  EXPECT_EQ(options.PauseAfter(100, true), absl::Seconds(5));
}

TEST(S3Options, TimeLimitsComeFromTheEnvironment) {
  S3Options options;
  setenv("LIQUIDBLEND_S3_STALL_TIMEOUT", "3s", 1);
  setenv("LIQUIDBLEND_S3_PART_BYTES", "many", 1);
  EXPECT_THAT(options.FillFromEnvironment(),
              Fails(Code::kInvalidArgument, "LIQUIDBLEND_S3_PART_BYTES is 'many'"));
  setenv("LIQUIDBLEND_S3_PART_BYTES", "2048", 1);
  EXPECT_THAT(options.FillFromEnvironment(), Succeeds());
  EXPECT_EQ(options.stall_timeout, absl::Seconds(3));
  EXPECT_EQ(options.part_bytes, 2048);
  for (const char* name : {"LIQUIDBLEND_S3_STALL_TIMEOUT", "LIQUIDBLEND_S3_PART_BYTES"}) {
    unsetenv(name);
  }
}

TEST(S3Options, NamesTheFieldOutOfRange) {
  const auto message = [](auto change) {
    S3Options options;
    options.cache_directory = "cache";
    change(options);
    return std::string(options.Validate().message());
  };
  EXPECT_EQ(message([](S3Options&) {}), "");
  EXPECT_THAT(message([](S3Options& o) { o.connect_timeout = absl::ZeroDuration(); }),
              HasSubstr("connect_timeout"));
  EXPECT_THAT(message([](S3Options& o) { o.stall_timeout = absl::Milliseconds(4999); }),
              HasSubstr("stall_timeout"));
  EXPECT_THAT(message([](S3Options& o) { o.complete_timeout = -absl::Seconds(1); }),
              HasSubstr("complete_timeout"));
  EXPECT_THAT(message([](S3Options& o) { o.part_bytes = 1023; }), HasSubstr("part_bytes"));
}

}  // namespace
}  // namespace liquidblend::store
