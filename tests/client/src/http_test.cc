#include "client/src/http.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <string>

#include "client/src/direct_files.h"

namespace liquidblend::client {
namespace {

using ::testing::HasSubstr;

class HttpTest : public ::testing::Test {
 protected:
  // With a proxy the hosts' addresses are not looked at.
  HttpTest() {
    for (const char* name : {"http_proxy", "https_proxy", "HTTPS_PROXY", "all_proxy", "ALL_PROXY"})
      unsetenv(name);
  }

  static absl::Status Get(const std::string& url, HttpHosts hosts) {
    return Http("", hosts).Get(url, [](absl::string_view) { return true; }).status();
  }

  static absl::Status PutWith(const std::map<std::string, std::string>& headers) {
    return Http("", HttpHosts::kAny)
        .Put("http://127.0.0.1:1/", headers, 0, [](char*, size_t) { return size_t{0}; })
        .status();
  }
};

TEST_F(HttpTest, AServerElsewhereNamesNoServiceOfThisMachine) {
  for (const char* host : {"127.0.0.1", "127.1.2.3", "localhost", "[::1]", "0.0.0.0",
                           "[::ffff:127.0.0.1]", "169.254.169.254", "[fe80::1]", "2130706433"}) {
    const absl::Status status =
        Get("http://" + std::string(host) + ":1/secret?key=1", HttpHosts::kElsewhere);
    EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
    EXPECT_THAT(status.message(), HasSubstr("/secret: is on this machine or a link-local")) << host;
  }
  const absl::Status allowed = Get("http://127.0.0.1:1/", HttpHosts::kAny);
  EXPECT_EQ(allowed.message(), "http://127.0.0.1:1/: Couldn't connect to server");
}

TEST_F(HttpTest, HostsOfThisMachineAreForServersOfThisMachine) {
  EXPECT_EQ(HostsOf("localhost:50051"), HttpHosts::kAny);
  EXPECT_EQ(HostsOf("127.0.0.1:1,127.0.0.1:2"), HttpHosts::kAny);
  EXPECT_EQ(HostsOf("127.0.0.1:1,10.0.0.1:2"), HttpHosts::kElsewhere);
  EXPECT_EQ(HostsOf("blend.example.org:50051"), HttpHosts::kElsewhere);
}

TEST_F(HttpTest, AHeaderIsOneLine) {
  for (const std::map<std::string, std::string>& headers :
       {std::map<std::string, std::string>{
            {"x", "1\r\nContent-Length: 0\r\n\r\nDELETE / HTTP/1.1"}},
        {{"x: 1\r\ny", "1"}},
        {{"", "1"}},
        {{"x", std::string("\0", 1)}}}) {
    EXPECT_EQ(PutWith(headers).code(), absl::StatusCode::kDataLoss);
  }
  const absl::Status sent = PutWith({{"x-amz-checksum-sha256", "mJ+/=="}, {"if-none-match", "*"}});
  EXPECT_EQ(sent.code(), absl::StatusCode::kUnavailable) << "nobody listens";
}

TEST_F(HttpTest, NothingIsSentToUrlsThatDoNotFitTheFile) {
  Http http("", HttpHosts::kAny);
  v1::PresignUploadResponse::File urls;
  for (int k = 0; k < 3; ++k) urls.add_part_urls("http://127.0.0.1:1/");
  const UploadFile file = {"/nonexistent/f_1.ply", "f_1.ply", 10};
  for (const int64_t part_bytes :
       {int64_t{0}, int64_t{-1}, int64_t{1}, int64_t{6}, int64_t{1} << 62}) {
    urls.set_part_bytes(part_bytes);
    const absl::Status status = SendToUrls(http, file, urls, RetryOptions{}, [](int64_t) {});
    EXPECT_EQ(status.code(), absl::StatusCode::kInternal) << part_bytes;
    EXPECT_THAT(status.message(), HasSubstr("not for its size"));
  }
}

}  // namespace
}  // namespace liquidblend::client
