#include "core/store/blobs/aws_credentials.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "absl/time/clock.h"
#include "tests/core/store/blobs/http_fake.h"
#include "tests/core/store/store_testing.h"

namespace liquidblend::store {
namespace {

using Code = absl::StatusCode;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kVariables[] = {"HOME",
                                      "AWS_ACCESS_KEY_ID",
                                      "AWS_SECRET_ACCESS_KEY",
                                      "AWS_SESSION_TOKEN",
                                      "AWS_SHARED_CREDENTIALS_FILE",
                                      "AWS_PROFILE",
                                      "AWS_CONTAINER_CREDENTIALS_FULL_URI",
                                      "AWS_CONTAINER_CREDENTIALS_RELATIVE_URI",
                                      "AWS_CONTAINER_AUTHORIZATION_TOKEN",
                                      "AWS_CONTAINER_AUTHORIZATION_TOKEN_FILE",
                                      "AWS_EC2_METADATA_SERVICE_ENDPOINT",
                                      "AWS_EC2_METADATA_DISABLED"};

std::string JsonOf(const std::string& id, absl::Time expires) {
  return absl::StrCat(R"({"Code": "Success", "AccessKeyId": ")", id,
                      R"(", "SecretAccessKey": "hush", "Token": "token", "Expiration": ")",
                      absl::FormatTime("%Y-%m-%dT%H:%M:%SZ", expires, absl::UTCTimeZone()), "\"}");
}

class AwsCredentialsTest : public ::testing::Test {
 protected:
  AwsCredentialsTest() {
    for (const char* name : kVariables) unsetenv(name);
    Set("HOME", folder_.path());
    Set("AWS_EC2_METADATA_DISABLED", "true");
  }
  ~AwsCredentialsTest() override {
    for (const char* name : kVariables) unsetenv(name);
  }
  static void Set(const char* name, const std::string& value) { setenv(name, value.c_str(), 1); }
  void Write(const std::string& name, const std::string& text) {
    std::filesystem::create_directories(std::filesystem::path(folder_.path() + name).parent_path());
    std::ofstream(folder_.path() + name) << text;
  }
  static std::string KeyId(AwsCredentialsProvider& provider) {
    const auto credentials = provider.Get();
    return credentials.ok() ? credentials->access_key_id : credentials.status().ToString();
  }

  TemporaryFolder folder_;
  absl::Time now_ = absl::Now();  // clock of the providers that take one
};

TEST_F(AwsCredentialsTest, TheFirstSourceThatHasSomeIsTaken) {
  AwsCredentialsProvider none({});
  EXPECT_THAT(none.Get(), Fails(Code::kInvalidArgument, "AWS_ACCESS_KEY_ID"));
  HttpFake http([](const HttpFake::Request&) {
    return HttpFake::Answer{200, JsonOf("container", absl::Now() + absl::Hours(1))};
  });
  Set("AWS_CONTAINER_CREDENTIALS_FULL_URI", http.url() + "/role");
  AwsCredentialsProvider container({});
  EXPECT_EQ(KeyId(container), "container");
  Write("/.aws/credentials", "[default]\naws_access_key_id=file\naws_secret_access_key=hush\n");
  AwsCredentialsProvider file({});
  EXPECT_EQ(KeyId(file), "file");
  Set("AWS_ACCESS_KEY_ID", "environment");
  Set("AWS_SECRET_ACCESS_KEY", "hush");
  AwsCredentialsProvider environment({});
  EXPECT_EQ(KeyId(environment), "environment");
  AwsCredentialsProvider given({"given", "hush", ""});
  EXPECT_EQ(KeyId(given), "given");
}

TEST_F(AwsCredentialsTest, AFileMayHaveSeveralProfiles) {
  Write("/keys",
        "# comment\n[default]\naws_access_key_id = a\naws_secret_access_key = b\n\n"
        "[ studio ]\n; comment\nAWS_ACCESS_KEY_ID = c = d\naws_secret_access_key=e\n"
        "aws_session_token = f\n");
  Set("AWS_SHARED_CREDENTIALS_FILE", folder_.path() + "/keys");
  EXPECT_EQ((*CredentialsFromFile())->credentials.access_key_id, "a");
  Set("AWS_PROFILE", "studio");
  const auto studio = CredentialsFromFile();
  ASSERT_THAT(studio, Succeeds());
  EXPECT_EQ((*studio)->credentials.access_key_id, "c = d");
  EXPECT_EQ((*studio)->credentials.secret_access_key, "e");
  EXPECT_EQ((*studio)->credentials.session_token, "f");
  Set("AWS_PROFILE", "nobody");
  EXPECT_THAT(CredentialsFromFile(), Fails(Code::kUnavailable, "'nobody'"));
  Set("AWS_SHARED_CREDENTIALS_FILE", folder_.path() + "/missing");
  EXPECT_THAT(CredentialsFromFile(), Fails(Code::kUnavailable, "/missing"));
}

TEST_F(AwsCredentialsTest, AFileIsReadAgainWhenItsKeyIsRefusedButNotInAStorm) {
  const auto write = [&](const std::string& id) {
    Write("/.aws/credentials",
          "[default]\naws_access_key_id=" + id + "\naws_secret_access_key=hush\n");
  };
  write("old");
  AwsCredentialsProvider provider({}, [this] { return now_; });
  const AwsCredentials old = *provider.Get();
  write("new");
  EXPECT_EQ(KeyId(provider), "old");  // as long as nobody refuses it
  EXPECT_TRUE(provider.Renew(old));
  EXPECT_EQ(KeyId(provider), "new");
  EXPECT_TRUE(provider.Renew(old));  // another request with the old one, refused meanwhile
  const AwsCredentials current = *provider.Get();
  write("newest");
  now_ += absl::Milliseconds(999);
  EXPECT_FALSE(provider.Renew(current));  // read for a refusal less than a second ago
  now_ += absl::Milliseconds(1);
  EXPECT_TRUE(provider.Renew(current));
  now_ += absl::Seconds(1);
  EXPECT_FALSE(provider.Renew(*provider.Get()));  // nothing newer
}

TEST_F(AwsCredentialsTest, AContainerIsAskedWithItsToken) {
  std::string authorization, answer;
  HttpFake http([&](const HttpFake::Request& request) {
    authorization = request.headers.at("authorization");
    return HttpFake::Answer{200, answer};
  });
  Set("AWS_CONTAINER_CREDENTIALS_FULL_URI", http.url() + "/v1/credentials");
  Write("/token", "from the file\n");
  Set("AWS_CONTAINER_AUTHORIZATION_TOKEN_FILE", folder_.path() + "/token");
  HttpClient client({});
  for (const char* bad : {"", "[]", "{\"AccessKeyId\": 7}", "{\"AccessKeyId\": \"a\"}"}) {
    answer = bad;
    EXPECT_THAT(CredentialsFromContainer(client), Fails(Code::kUnavailable, "not a valid answer"));
  }
  EXPECT_EQ(authorization, "from the file");
  answer = JsonOf("container", absl::Now() + absl::Hours(1));
  EXPECT_EQ((*CredentialsFromContainer(client))->credentials.access_key_id, "container");
}

// What an endpoint answers goes into headers of later requests.
TEST_F(AwsCredentialsTest, AnAnswerAddsNoHeadersAndHasALimit) {
  std::string token = "session", answer;
  HttpFake http([&](const HttpFake::Request& request) -> HttpFake::Answer {
    if (request.method == "PUT") return {200, token};
    if (absl::EndsWith(request.path, "/security-credentials/")) return {200, "the-role"};
    return {200, answer};
  });
  Set("AWS_CONTAINER_CREDENTIALS_FULL_URI", http.url() + "/v1/credentials");
  unsetenv("AWS_EC2_METADATA_DISABLED");
  Set("AWS_EC2_METADATA_SERVICE_ENDPOINT", http.url());
  HttpClient client({});
  answer = JsonOf("id", absl::Now() + absl::Hours(1));
  EXPECT_THAT(CredentialsFromContainer(client), Succeeds());
  EXPECT_THAT(CredentialsFromInstance(client), Succeeds());
  token = "session\r\nX-Other: header";
  EXPECT_THAT(CredentialsFromInstance(client), Fails(Code::kUnavailable, "is not one line"));
  answer = JsonOf("id\\r\\nX-Other: header", absl::Now() + absl::Hours(1));
  EXPECT_THAT(CredentialsFromContainer(client), Fails(Code::kUnavailable, "not a valid answer"));
  answer = JsonOf("id", absl::Now() + absl::Hours(1)) + std::string(1 << 16, ' ');
  EXPECT_THAT(CredentialsFromContainer(client), Fails(Code::kUnavailable, "more than 65536 bytes"));
}

TEST_F(AwsCredentialsTest, TokensGoToNoOtherHostUnencrypted) {
  HttpClient client({});
  for (const std::string url :
       {"http://10.0.0.1/", "http://127.0.0.1.example.org/", "http://localhost@10.0.0.1/",
        "http://localhost:80@10.0.0.1/", "ftp://127.0.0.1/"}) {
    Set("AWS_CONTAINER_CREDENTIALS_FULL_URI", url);
    EXPECT_THAT(CredentialsFromContainer(client),
                Fails(Code::kInvalidArgument, "neither https nor of this host"))
        << url;
  }
}

TEST_F(AwsCredentialsTest, AnInstanceIsAskedByVersion2) {
  const std::string roles = "/latest/meta-data/iam/security-credentials/";
  HttpFake http([&](const HttpFake::Request& request) -> HttpFake::Answer {
    if (request.method == "PUT" && request.path == "/latest/api/token") return {200, "session"};
    const auto token = request.headers.find("x-aws-ec2-metadata-token");
    if (token == request.headers.end() || token->second != "session") return {401, ""};
    if (request.path == roles) return {200, "the-role\n"};
    if (request.path == roles + "the-role") {
      return {200, JsonOf("instance", absl::Now() + absl::Hours(6))};
    }
    return {404, ""};
  });
  unsetenv("AWS_EC2_METADATA_DISABLED");
  Set("AWS_EC2_METADATA_SERVICE_ENDPOINT", http.url());
  AwsCredentialsProvider provider({});
  const auto credentials = provider.Get();
  ASSERT_THAT(credentials, Succeeds());
  EXPECT_EQ(credentials->access_key_id, "instance");
  EXPECT_EQ(credentials->session_token, "token");
  EXPECT_EQ(KeyId(provider), "instance");
  EXPECT_EQ(http.num_requests(), 3);  // they last for hours
}

TEST_F(AwsCredentialsTest, ADetachedRoleMayComeBack) {
  const std::string roles = "/latest/meta-data/iam/security-credentials/";
  bool has_role = false;
  HttpFake http([&](const HttpFake::Request& request) -> HttpFake::Answer {
    if (request.method == "PUT") return {200, "session"};
    if (!has_role) return {404, ""};
    if (request.path == roles) return {200, "the-role\n"};
    return {200, JsonOf("instance", absl::Now() + absl::Seconds(2))};
  });
  unsetenv("AWS_EC2_METADATA_DISABLED");
  Set("AWS_EC2_METADATA_SERVICE_ENDPOINT", http.url());
  AwsCredentialsProvider never({});
  EXPECT_THAT(never.Get(), Fails(Code::kUnavailable, "names no role"));
  has_role = true;
  AwsCredentialsProvider provider({});
  EXPECT_EQ(KeyId(provider), "instance");
  has_role = false;
  const absl::Time deadline = absl::Now() + absl::Seconds(30);
  while (provider.Get().ok()) ASSERT_LT(absl::Now(), deadline);
  EXPECT_THAT(provider.Get(), Fails(Code::kPermissionDenied, "have expired"));
  has_role = true;
  while (!provider.Get().ok()) ASSERT_LT(absl::Now(), deadline);
  EXPECT_EQ(KeyId(provider), "instance");
}

TEST_F(AwsCredentialsTest, ADefaultFileThatIsBeingReplacedIsWaitedFor) {
  std::filesystem::create_directories(folder_.path() + "/.aws");
  AwsCredentialsProvider provider({});
  EXPECT_THAT(provider.Get(), Fails(Code::kUnavailable, "no credentials for S3"));
}

TEST_F(AwsCredentialsTest, TemporaryOnesAreRenewedBeforeTheyExpire) {
  int num_given = 0;
  bool is_away = false;
  HttpFake http([&](const HttpFake::Request&) -> HttpFake::Answer {
    if (is_away) return {503, "hush"};
    return {200, JsonOf(absl::StrCat("key ", ++num_given), now_ + absl::Minutes(4))};
  });
  Set("AWS_CONTAINER_CREDENTIALS_FULL_URI", http.url());
  AwsCredentialsProvider provider({}, [this] { return now_; });
  EXPECT_EQ(KeyId(provider), "key 1");
  now_ += absl::Milliseconds(999);
  EXPECT_EQ(KeyId(provider), "key 1");  // it was read less than a second ago
  now_ += absl::Milliseconds(1);
  EXPECT_EQ(KeyId(provider), "key 2");
  is_away = true;
  now_ += absl::Seconds(1);
  EXPECT_EQ(KeyId(provider), "key 2");  // still good
}

TEST_F(AwsCredentialsTest, AnEndpointThatIsAwayIsUnavailableAndTellsNoSecret) {
  HttpFake http([&](const HttpFake::Request&) -> HttpFake::Answer { return {500, "hush"}; });
  Set("AWS_CONTAINER_CREDENTIALS_FULL_URI", http.url() + "/role");
  Set("AWS_CONTAINER_AUTHORIZATION_TOKEN", "confidential");
  AwsCredentialsProvider provider({});
  const absl::Status status = provider.Get().status();
  EXPECT_THAT(status, Fails(Code::kUnavailable, "HTTP status 500"));
  for (const char* secret : {"hush", "confidential"}) {
    EXPECT_THAT(std::string(status.message()), Not(HasSubstr(secret)));
  }
}

}  // namespace
}  // namespace liquidblend::store
