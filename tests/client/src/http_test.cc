#include "client/src/http.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <map>
#include <string>
#include <thread>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "client/src/direct_files.h"
#include "tests/client/src/connection/without_proxies.h"
#include "tests/core/store/blobs/loopback_listener.h"

namespace liquidblend::client {
namespace {

using ::testing::HasSubstr;

// A host on the loopback interface that takes one connection. It reads what comes first and answers
// `head`, then `again` for as long as the client takes it, at most 30 s.
class Host {
 public:
  Host(std::string head, std::string again, absl::Duration pause)
      : thread_([this, head = std::move(head), again = std::move(again), pause] {
          const int socket = listener_.Accept();
          if (socket < 0) return;
          num_connections = 1;
          char request[4096];
          bool is_open = recv(socket, request, sizeof(request), 0) > 0 && Send(socket, head);
          const absl::Time end = absl::Now() + absl::Seconds(30);
          while (is_open && !again.empty() && absl::Now() < end) {
            absl::SleepFor(pause);
            is_open = Send(socket, again);
          }
          close(socket);
        }) {}
  ~Host() {
    listener_.Shutdown();
    thread_.join();
  }

  std::string address() const { return absl::StrCat("127.0.0.1:", listener_.port()); }
  std::string url() const { return absl::StrCat("http://", address(), "/file?key=1"); }

  std::atomic<int> num_connections = 0;

 private:
  static bool Send(int socket, const std::string& bytes) {
    return send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL) > 0;
  }

  store::LoopbackListener listener_;
  std::thread thread_;
};

constexpr char kChunked[] = "HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n";
constexpr char kWhole[] = "HTTP/1.1 200 OK\r\nContent-Length: 0\r\nConnection: close\r\n\r\n";

std::string ChunkOf(size_t num_bytes) {
  return absl::StrCat(absl::Hex(num_bytes), "\r\n", std::string(num_bytes, 'a'), "\r\n");
}

class HttpTest : public ::testing::Test {
 protected:
  // An empty file, to `url`.
  static absl::StatusOr<HttpAnswer> Put(const std::string& url, absl::Duration answer_timeout) {
    return Http("", HttpHosts::kAny, answer_timeout).Put(url, {}, 0, [](char*, size_t) {
      return size_t{0};
    });
  }

  static absl::Status Get(const std::string& url, HttpHosts hosts) {
    return Http("", hosts).Get(url, [](absl::string_view) { return true; }).status();
  }

  static absl::Status PutWith(const std::map<std::string, std::string>& headers) {
    return Http("", HttpHosts::kAny)
        .Put("http://127.0.0.1:1/", headers, 0, [](char*, size_t) { return size_t{0}; })
        .status();
  }

 private:
  const WithoutProxies without_proxies_;
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

// A proxy of the environment is no way around this for requests that do not go through it.
TEST_F(HttpTest, AServerElsewhereNamesNoneOfItPastAProxyEither) {
  const auto expect_refused = [](const std::string& url) {
    EXPECT_THAT(Get(url, HttpHosts::kElsewhere).message(), HasSubstr("is on this machine"));
  };
  Host host(kWhole, "", absl::ZeroDuration());
  setenv("https_proxy", "http://127.0.0.1:1", 1);
  expect_refused(host.url());
  setenv("http_proxy", "http://127.0.0.1:1", 1);
  setenv("no_proxy", "localhost,127.0.0.1", 1);
  expect_refused(host.url());
  EXPECT_EQ(host.num_connections, 0);
}

TEST_F(HttpTest, AProxyOnThisMachineIsUsed) {
  Host proxy(kWhole, "", absl::ZeroDuration());
  setenv("http_proxy", proxy.address().c_str(), 1);
  EXPECT_TRUE(Get("http://store.invalid/file", HttpHosts::kElsewhere).ok());
  EXPECT_EQ(proxy.num_connections, 1);
}

TEST_F(HttpTest, AnAnswerIsNotReadWithoutEnd) {
  const Host long_body(kChunked, ChunkOf(16 << 10), absl::ZeroDuration());
  const absl::Status too_long = Put(long_body.url(), absl::Minutes(1)).status();
  EXPECT_EQ(too_long.code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(too_long.message(), HasSubstr("/file: the answer is longer than 64 KiB"));

  const Host long_head("HTTP/1.1 200 OK\r\n", "x: " + std::string(16 << 10, 'a') + "\r\n",
                       absl::ZeroDuration());
  EXPECT_THAT(Put(long_head.url(), absl::Minutes(1)).status().message(),
              HasSubstr("headers are longer than 256 KiB"));

  const Host slow(kChunked, ChunkOf(1), absl::Milliseconds(20));
  EXPECT_THAT(Put(slow.url(), absl::Milliseconds(200)).status().message(),
              HasSubstr("the answer does not end"));
}

TEST_F(HttpTest, OfAnErrorsBodyTheBeginningIsEnough) {
  const Host host("HTTP/1.1 500 x\r\nTransfer-Encoding: chunked\r\n\r\n", ChunkOf(16 << 10),
                  absl::ZeroDuration());
  const auto answer =
      Http("", HttpHosts::kAny).Get(host.url(), [](absl::string_view) { return true; });
  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_EQ(answer->status, 500);
  EXPECT_EQ(answer->body.size(), size_t{64} << 10);
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
