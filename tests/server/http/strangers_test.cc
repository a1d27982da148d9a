// Clients that use up what many share: memory, connections, attention.
#include <thread>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "tests/server/http/port_testing.h"

namespace liquidblend::http::strangers_test {
namespace {

using testing::HasSubstr;

constexpr char kPost[] =
    "POST /v1/families HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n";

class StrangersTest : public PortTest {
 protected:
  // How much is taken of text that is repeated without an end.
  static size_t NumTaken(HttpClient& client, const std::string& text) {
    size_t num_taken = 0;
    while (num_taken < (size_t{64} << 20) && client.Send(text)) num_taken += text.size();
    return num_taken;
  }
  int NumWatched() const { return backends_.operation_looks.num_looks(); }
};

TEST_F(StrangersTest, LinesBetweenChunksAreBounded) {
  for (const char* begin : {"1;", "0\r\nX: ", "1\r\n{\r\n1;"}) {
    HttpClient client(port_->port());
    ASSERT_TRUE(client.Send(absl::StrCat(kPost, "Transfer-Encoding: chunked\r\n\r\n", begin)));
    // Most of it is in the sockets' buffers.
    EXPECT_LT(NumTaken(client, std::string(4096, 'a')), size_t{32} << 20) << begin;
    EXPECT_TRUE(client.IsClosed()) << begin;
  }
}

TEST_F(StrangersTest, AClientThatSendsOnAndLeavesIsNoticed) {
  const store::pb::JobRecord job = SubmitImport("drop");
  for (const std::string& call : {absl::StrCat("POST /v1/operations/", job.id(), ":wait"),
                                  absl::StrCat("GET /v1/operations/", job.id(), ":watch")}) {
    {
      HttpClient client(port_->port());
      client.Send(absl::StrCat(call, " HTTP/1.1\r\nHost: localhost\r\n\r\n"));
      client.Send(std::string(20'000, 'x'));
      while (NumWatched() == 0) std::this_thread::yield();
    }
    while (NumWatched() > 0) std::this_thread::yield();
  }
}

TEST_F(StrangersTest, RequestsBeyondWhatIsKeptEndTheConnection) {
  PortOptions options;
  options.num_threads = 1;
  Start(options);
  OccupyFrames();
  HttpClient client(port_->port());
  const std::string request = "GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n";
  client.Send(
      "GET /v1/families/splash/frame.drc?weights=0.25 HTTP/1.1\r\nHost: a.localhost\r\n\r\n");
  client.Send("GET /v1/families/splash/frame.drc?weights=0.25 HTTP/1.1\r\nHost: localhost\r\n\r\n");
  std::string many;
  for (int k = 0; k < 1000; ++k) many += request;
  client.Send(many);
  while (WaitingCost() == 0) std::this_thread::yield();
  // The port's only thread reads from all connections in turns.
  for (int k = 0; k < 10; ++k) EXPECT_EQ(HttpClient(port_->port()).Get("/healthz").code, 200);
  release_.Notify();
  EXPECT_EQ(client.ReadReply().code, 403);
  EXPECT_EQ(client.ReadReply().code, 200);
  int num_answers = 0;
  while (client.ReadReply().code == 200) ++num_answers;
  EXPECT_LT(num_answers, 1000);
}

TEST_F(StrangersTest, LengthsAndCodingsThatNobodyCanFollowEndTheConnection) {
  const std::string behind = "GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n";
  for (const char* header :
       {"Content-Length: 9223372036854775808", "Transfer-Encoding: gzip",
        "Content-Length: 18446744073709551615", "Transfer-Encoding: chunked, gzip"}) {
    HttpClient client(port_->port());
    client.Send(absl::StrCat(kPost, header, "\r\n\r\n", behind));
    const HttpReply reply = client.ReadReply();
    EXPECT_GE(reply.code, 400) << header;
    EXPECT_LT(reply.code, 500) << header;
    EXPECT_EQ(client.ReadReply().code, 0) << header << ": what follows is no request";
  }
}

TEST_F(StrangersTest, AnswersThatNobodyReadsAreBounded) {
  PortOptions options;
  options.router.max_answers_bytes = 4096;
  Start(options);
  const std::string page =
      "GET /v1/families/splash/frame.obj?weights=0.5 HTTP/1.1\r\nHost: localhost\r\n\r\n";
  std::vector<std::unique_ptr<HttpClient>> idle;
  const absl::Time give_up = absl::Now() + absl::Seconds(20);
  std::string refusal;
  while (refusal.empty() && absl::Now() < give_up) {
    // Its answers stay here once the sockets are full.
    idle.push_back(std::make_unique<HttpClient>(port_->port()));
    std::string requests;
    for (int k = 0; k < 80; ++k) requests += page;
    idle.back()->Send(requests);
    HttpClient client(port_->port());
    const HttpReply reply = client.Get("/v1/families/splash/frame.obj?weights=0.5");
    if (reply.code == 503) refusal = reply.body;
  }
  EXPECT_THAT(refusal, HasSubstr("TOO_MANY_ANSWERS"));
  idle.clear();
  HttpClient client(port_->port());
  int code = 503;
  while (code == 503 && absl::Now() < give_up) {
    code = client.Get("/v1/families/splash/frame.obj?weights=0.5").code;
  }
  EXPECT_EQ(code, 200) << "what was held is free again";
}

TEST_F(StrangersTest, ALargeBodyIsReadToItsEnd) {
  HttpClient client(port_->port());
  const std::string body(size_t{1} << 20, ' ');
  client.Send(absl::StrCat(kPost, "Content-Length: ", body.size() + 2, "\r\n\r\n{}"));
  EXPECT_TRUE(client.Send(body));
  EXPECT_EQ(client.ReadReply().code, 400) << "nothing is named";
}

}  // namespace
}  // namespace liquidblend::http::strangers_test
