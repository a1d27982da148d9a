#include <string>
#include <thread>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_split.h"
#include "core/base/log.h"
#include "server/http/port.h"
#include "tests/server/http/port_testing.h"

namespace liquidblend::http {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class WebSocketTest : public PortTest {
 protected:
  explicit WebSocketTest(const server::BackendsOptions& options = Options()) : PortTest(options) {}

  static v1::StreamFramesRequest Lossless() {
    v1::StreamFramesRequest request;
    request.set_family("families/splash");
    request.add_weights(0.5);
    request.set_lossless(true);
    return request;
  }

  // Loops in real time, at this rate.
  static v1::StreamFramesRequest Endless(double frames_per_second) {
    v1::StreamFramesRequest request = Lossless();
    request.set_lossless(false);
    request.set_loop(true);
    request.set_frames_per_second(frames_per_second);
    return request;
  }

  static bool Send(HttpClient& client, const v1::StreamFramesRequest& request) {
    return client.SendMessage(2, request.SerializeAsString());
  }

  static v1::StreamFramesResponse ReadFrame(HttpClient& client) {
    const WebSocketMessage message = client.ReadMessage();
    EXPECT_EQ(message.opcode, 2) << message.close_code() << " " << message.close_reason();
    v1::StreamFramesResponse response;
    EXPECT_TRUE(response.ParseFromString(message.payload));
    return response;
  }

  // The first message that is no frame.
  static WebSocketMessage ReadToEnd(HttpClient& client) {
    while (true) {
      WebSocketMessage message = client.ReadMessage();
      if (message.opcode != 2) return message;
    }
  }
};

TEST_F(WebSocketTest, ALosslessStreamGivesAllFramesAndEnds) {
  HttpClient client(port_->port());
  EXPECT_EQ(client.Upgrade().code, 101);
  ASSERT_TRUE(Send(client, Lossless()));
  for (int i = 0; i < server::kFamilyFrames; ++i) {
    const v1::StreamFramesResponse response = ReadFrame(client);
    EXPECT_EQ(response.frame_index(), i);
    EXPECT_EQ(response.frame().data().substr(0, 5), "DRACO");
  }
  const WebSocketMessage end = client.ReadMessage();
  EXPECT_EQ(end.close_code(), 1000);
  EXPECT_EQ(end.close_reason(), "the animation has ended");
}

TEST_F(WebSocketTest, OpenStreamsAreCounted) {
  const auto await_streams = [&](int count) {
    const std::string line = absl::StrCat("liquidblend_streams ", count, "\n");
    const absl::Time deadline = absl::Now() + absl::Seconds(60);
    while (!absl::StrContains(backends_.metrics.Text({}), line)) {
      ASSERT_LT(absl::Now(), deadline) << line;
    }
  };
  HttpClient one(port_->port()), other(port_->port());
  for (HttpClient* client : {&one, &other}) {
    EXPECT_EQ(client->Upgrade().code, 101);
    ASSERT_TRUE(Send(*client, Endless(24)));
    ReadFrame(*client);
  }
  await_streams(2);
  one.Close();
  await_streams(1);
  port_.reset();
  await_streams(0);
}

TEST_F(WebSocketTest, TheLogTellsOfItWhenItHasEnded) {
  base::StartLog("server", base::LogLevel::kDebug, base::LogFormat::kJson);
  testing::internal::CaptureStderr();
  {
    HttpClient client(port_->port());
    const auto upgraded = client.Upgrade("X-Request-Id: shot-17\r\n");
    EXPECT_EQ(upgraded.code, 101);
    EXPECT_EQ(upgraded.headers.at("x-request-id"), "shot-17");
    v1::StreamFramesRequest request = Lossless();
    request.set_rate(1e9);
    ASSERT_TRUE(Send(client, request));
    EXPECT_EQ(client.ReadMessage().close_code(), 4400);
  }
  port_.reset();
  const std::string log = testing::internal::GetCapturedStderr();
  EXPECT_THAT(log, testing::ContainsRegex(
                       R"("message":"call","method":"GET","path":"/v1/stream","status":"4400",)"
                       R"("ms":"[0-9.]+","principal":"anonymous","client":"127.0.0.1:[0-9]+",)"
                       R"("request_id":"shot-17","error":"rate: )"));
}

// A server with memory for one and a half unread PLY frames.
class ImpatientWebSocketTest : public WebSocketTest {
 protected:
  static constexpr int64_t kPlyBytes = 14'000;

  ImpatientWebSocketTest() : WebSocketTest(ImpatientOptions()) {}

  static server::BackendsOptions ImpatientOptions() {
    server::BackendsOptions options = Options();
    options.unread = {.max_bytes = kPlyBytes * 3 / 2, .patience = absl::Seconds(2)};
    return options;
  }
};

TEST_F(ImpatientWebSocketTest, AClientThatReadsNothingIsDisconnectedOnceOthersNeedTheMemory) {
  HttpClient other(port_->port()), idle(port_->port()), reader(port_->port());
  const auto size =
      static_cast<double>(other.Get("/v1/families/splash/frame.ply?weights=0.5").body.size());
  ASSERT_NEAR(size, kPlyBytes, 0.2 * kPlyBytes);
  EXPECT_EQ(idle.Upgrade().code, 101);
  EXPECT_EQ(reader.Upgrade().code, 101);
  v1::StreamFramesRequest large = Endless(240);
  large.mutable_encoding()->set_format(v1::Encoding::PLY);
  ASSERT_TRUE(Send(idle, large));
  ASSERT_TRUE(Send(reader, Endless(100)));
  const auto num_streams = [&](int count) {
    return absl::StrContains(backends_.metrics.Text({}),
                             absl::StrCat("liquidblend_streams ", count, "\n"));
  };
  // Frames go on as long as the sockets' buffers have room for them.
  const absl::Time deadline = absl::Now() + absl::Seconds(60);
  do {
    const v1::StreamFramesResponse response = ReadFrame(reader);
    EXPECT_LT(response.frame().data().size(), kPlyBytes / 4);
  } while (!num_streams(1) && absl::Now() < deadline);
  EXPECT_TRUE(num_streams(1));
  ReadFrame(reader);
  EXPECT_EQ(ReadToEnd(idle).opcode, -1);  // behind the frames that it was sent
}

TEST_F(WebSocketTest, WeightsMayChangeWithEveryFrame) {
  HttpClient client(port_->port());
  ASSERT_EQ(client.Upgrade().code, 101);
  ASSERT_TRUE(Send(client, Endless(200)));
  EXPECT_THAT(ReadFrame(client).frame().weights(), ElementsAre(0.5));
  for (int i = 0; i < 30; ++i) {
    v1::StreamFramesRequest change;
    change.add_weights(0.01 * i);
    ASSERT_TRUE(Send(client, change));
    int num_old = 0;
    while (ReadFrame(client).frame().weights(0) != 0.01 * i) ASSERT_LT(++num_old, 2000);
  }
  v1::StreamFramesRequest other;
  other.set_family("families/drops");
  ASSERT_TRUE(Send(client, other));
  while (ReadFrame(client).frame().family() != "families/drops") {
  }
}

// The server is given no time to find the newer version by itself.
TEST_F(WebSocketTest, TheFirstFrameIsOfTheVersionThatIsAskedFor) {
  keep_versions_ = 2;
  ASSERT_EQ(HttpClient(port_->port()).Get("/v1/families/splash/frame.drc?weights=0.5").code, 200);
  for (const int64_t published : {2, 3}) {
    PublishFamily("splash", "a", "b", static_cast<uint64_t>(published));
    HttpClient client(port_->port());
    ASSERT_EQ(client.Upgrade().code, 101);
    v1::StreamFramesRequest request = Endless(100);
    request.set_min_version(published);
    ASSERT_TRUE(Send(client, request));
    EXPECT_EQ(ReadFrame(client).frame().version(), published);
  }
  HttpClient client(port_->port());
  ASSERT_EQ(client.Upgrade().code, 101);
  v1::StreamFramesRequest request = Endless(100);
  request.set_version(2);
  ASSERT_TRUE(Send(client, request));
  EXPECT_EQ(ReadFrame(client).frame().version(), 2);
}

TEST_F(WebSocketTest, LateFramesAreDroppedAndCounted) {
  HttpClient client(port_->port());
  ASSERT_EQ(client.Upgrade().code, 101);
  ASSERT_TRUE(Send(client, Endless(100)));
  const int64_t num_before = ReadFrame(client).num_dropped();
  server::FrameWork work;
  work.run = [] { absl::SleepFor(absl::Milliseconds(200)); };
  ASSERT_TRUE(backends_.frames.Post(std::move(work), false).ok());
  int64_t num_dropped = num_before;
  for (int i = 0; i < 100 && num_dropped < num_before + 10; ++i) {
    num_dropped = ReadFrame(client).num_dropped();
  }
  EXPECT_GE(num_dropped - num_before, 10);
  EXPECT_THAT(MetricsText(), HasSubstr("liquidblend_frames_dropped_total{family=\"splash\"} "));
}

TEST_F(WebSocketTest, MistakesCloseWithCodeAndReason) {
  const auto end_of = [&](int opcode, const std::string& payload) {
    HttpClient client(port_->port());
    EXPECT_EQ(client.Upgrade().code, 101);
    EXPECT_TRUE(client.SendMessage(opcode, payload));
    return ReadToEnd(client);
  };
  v1::StreamFramesRequest unknown = Lossless();
  unknown.set_family("families/none");
  const WebSocketMessage not_found = end_of(2, unknown.SerializeAsString());
  EXPECT_EQ(not_found.close_code(), 4404);
  EXPECT_THAT(not_found.close_reason(), HasSubstr("none"));
  v1::StreamFramesRequest weights = Lossless();
  weights.add_weights(3);
  EXPECT_EQ(end_of(2, weights.SerializeAsString()).close_code(), 4400);
  EXPECT_EQ(end_of(2, "\x0a\xff").close_code(), 1007);
  EXPECT_EQ(end_of(1, "hello").close_code(), 1003);
  EXPECT_EQ(end_of(2, "").close_code(), 4400);          // no family is named
  EXPECT_EQ(end_of(8, "\x03\xe8").close_code(), 1000);  // the client's close comes back
  EXPECT_EQ(end_of(11, "").close_code(), 1002);         // a reserved opcode
}

TEST_F(WebSocketTest, ClientsThatCloseMakeNoSeriesOfTheirOwn) {
  base::StartLog("server", base::LogLevel::kInfo, base::LogFormat::kJson);
  testing::internal::CaptureStderr();
  for (const int code : {1000, 1011, 3000, 4404, 4500, 4599, 50000, 65535}) {
    HttpClient client(port_->port());
    ASSERT_EQ(client.Upgrade().code, 101);
    const std::string bytes = {static_cast<char>(code >> 8), static_cast<char>(code & 0xFF)};
    ASSERT_TRUE(client.SendMessage(8, bytes + "broken"));
    EXPECT_EQ(client.ReadMessage().close_code(), code) << "it comes back";
    EXPECT_TRUE(client.IsClosed());
  }
  const std::string none_left = "liquidblend_http_connections{kind=\"websocket\"} 0\n";
  const absl::Time give_up = absl::Now() + absl::Seconds(20);
  while (!absl::StrContains(MetricsText(), none_left) && absl::Now() < give_up) {
    std::this_thread::yield();
  }
  port_.reset();
  std::vector<std::string> counts;
  for (const absl::string_view line : absl::StrSplit(backends_.metrics.Text({}), '\n')) {
    const bool is_stream = absl::StartsWith(line, "liquidblend_requests_total") &&
                           absl::StrContains(line, "GET /v1/stream");
    if (is_stream) counts.emplace_back(line.substr(line.find("code=")));
  }
  EXPECT_THAT(counts, testing::UnorderedElementsAre(
                          HasSubstr(R"(code="1000")"),
                          testing::AllOf(HasSubstr(R"(code="4000")"), testing::EndsWith(" 7"))));
  const std::string log = testing::internal::GetCapturedStderr();
  EXPECT_THAT(log, HasSubstr(R"("error":"closed by the client: 'broken'")"));
  EXPECT_THAT(log, testing::Not(HasSubstr(R"("level":"error")")));
}

// Boost.Beast deadlocks if it reads a malformed frame while it closes the connection. Both frames
// come in one piece, so that the second one is there when the first one is refused.
TEST_F(WebSocketTest, AMalformedFrameBehindAMistakeLeavesNoConnection) {
  PortOptions options;
  options.close_timeout = absl::Milliseconds(200);
  Start(options);
  const std::string text_message("\x81\x80\0\0\0\0", 6);
  const std::string unmasked("\x82\0", 2);
  {
    HttpClient client(port_->port());
    ASSERT_EQ(client.Upgrade().code, 101);
    ASSERT_TRUE(client.Send(text_message + unmasked));
    EXPECT_EQ(ReadToEnd(client).close_code(), 1003);
  }
  const std::string none_left = "liquidblend_http_connections{kind=\"websocket\"} 0\n";
  const absl::Time give_up = absl::Now() + absl::Seconds(20);
  while (!absl::StrContains(MetricsText(), none_left) && absl::Now() < give_up) {
    std::this_thread::yield();
  }
  EXPECT_THAT(MetricsText(), HasSubstr(none_left));
}

TEST_F(WebSocketTest, LongMessagesAreRefused) {
  PortOptions options;
  options.max_message_bytes = 1000;
  Start(options);
  HttpClient client(port_->port());
  ASSERT_EQ(client.Upgrade().code, 101);
  ASSERT_TRUE(client.SendMessage(2, std::string(2000, 'a')));
  EXPECT_EQ(ReadToEnd(client).close_code(), 1009);
}

TEST_F(WebSocketTest, PagesOfOtherOriginsAreRefused) {
  HttpClient client(port_->port());
  EXPECT_EQ(client.Upgrade("Origin: https://evil.example\r\n").code, 403);
  HttpClient own(port_->port());
  EXPECT_EQ(own.Upgrade("Origin: http://localhost\r\n").code, 101);
}

TEST_F(WebSocketTest, PagesThatCallThisMachineByTheirNameAreRefused) {
  const auto upgrade = [this](const std::string& hosts) {
    HttpClient client(port_->port());
    client.Send(absl::StrCat("GET /v1/stream HTTP/1.1\r\n", hosts,
                             "Origin: http://evil.example\r\nConnection: Upgrade\r\n"
                             "Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
                             "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"));
    return client.ReadReply().code;
  };
  EXPECT_EQ(upgrade("Host: evil.example\r\n"), 403);
  EXPECT_EQ(upgrade("Host: localhost\r\nHost: evil.example\r\n"), 403);
  PortOptions options;
  options.router.hosts = {"evil.example"};
  Start(options);
  EXPECT_EQ(upgrade("Host: evil.example\r\n"), 101);
}

// As docs/operations/http.md says: pinged after half of the idle timeout, closed after all of it.
TEST_F(WebSocketTest, ASilentClientIsClosedAfterTheIdleTimeout) {
  PortOptions options;
  options.idle_timeout = absl::Seconds(3);
  Start(options);
  HttpClient client(port_->port());
  const absl::Time begin = absl::Now();
  ASSERT_EQ(client.Upgrade().code, 101);
  EXPECT_EQ(client.ReadMessage().opcode, 9);
  const absl::Duration pinged = absl::Now() - begin;
  EXPECT_TRUE(client.IsClosed());
  const absl::Duration closed = absl::Now() - begin;
  EXPECT_GE(pinged, absl::Seconds(1));
  EXPECT_LT(pinged, options.idle_timeout);
  EXPECT_GE(closed, absl::Seconds(2.5));
  EXPECT_LT(closed, 2 * options.idle_timeout);
}

TEST_F(WebSocketTest, SilentClientsArePingedAndThenClosed) {
  PortOptions options;
  options.idle_timeout = absl::Seconds(2);
  Start(options);
  HttpClient client(port_->port());
  ASSERT_EQ(client.Upgrade().code, 101);
  EXPECT_EQ(client.ReadMessage().opcode, 9);
  EXPECT_TRUE(client.IsClosed());
}

TEST_F(WebSocketTest, PingsAreAnswered) {
  HttpClient client(port_->port());
  ASSERT_EQ(client.Upgrade().code, 101);
  ASSERT_TRUE(client.SendMessage(9, "are you there"));
  const WebSocketMessage pong = client.ReadMessage();
  EXPECT_EQ(pong.opcode, 10);
  EXPECT_EQ(pong.payload, "are you there");
}

TEST_F(WebSocketTest, DrainingClosesStreamsAsGoingAway) {
  HttpClient busy(port_->port()), idle(port_->port());
  ASSERT_EQ(busy.Upgrade().code, 101);
  ASSERT_EQ(idle.Upgrade().code, 101);
  ASSERT_TRUE(Send(busy, Endless(100)));
  ReadFrame(busy);
  port_->Drain();
  for (HttpClient* client : {&busy, &idle}) {
    const WebSocketMessage end = ReadToEnd(*client);
    EXPECT_EQ(end.close_code(), 1001);
    EXPECT_THAT(end.close_reason(), HasSubstr("shutting down"));
  }
  HttpClient late(port_->port());
  EXPECT_EQ(late.Upgrade().code, 503);
}

TEST_F(WebSocketTest, AStopDoesNotWaitForClientsThatDoNotRead) {
  HttpClient client(port_->port());
  ASSERT_EQ(client.Upgrade().code, 101);
  v1::StreamFramesRequest request = Endless(240);
  ASSERT_TRUE(Send(client, request));
  ReadFrame(client);
  absl::SleepFor(absl::Milliseconds(300));
  const absl::Time begin = absl::Now();
  port_->Stop(absl::Milliseconds(100));
  EXPECT_LT(absl::Now() - begin, absl::Seconds(5));
}

TEST_F(WebSocketTest, ClientsMayVanishAtAnyTime) {
  for (int i = 0; i < 20; ++i) {
    HttpClient client(port_->port());
    ASSERT_EQ(client.Upgrade().code, 101);
    ASSERT_TRUE(Send(client, Endless(240)));
    if (i % 2 == 0) ReadFrame(client);
  }
  while (
      !absl::StrContains(MetricsText(), "liquidblend_http_connections{kind=\"websocket\"} 0\n")) {
    std::this_thread::yield();
  }
}

TEST_F(WebSocketTest, ManyStreamsAtOnceAreAllWhole) {
  std::vector<std::string> all(8);
  {
    std::vector<std::jthread> clients;
    for (std::string& bytes : all) {
      clients.emplace_back([&] {
        HttpClient client(port_->port());
        EXPECT_EQ(client.Upgrade().code, 101);
        EXPECT_TRUE(Send(client, Lossless()));
        for (int i = 0; i < server::kFamilyFrames; ++i) bytes += ReadFrame(client).frame().data();
        EXPECT_EQ(client.ReadMessage().close_code(), 1000);
      });
    }
  }
  for (const std::string& bytes : all) EXPECT_EQ(bytes, all[0]);
  EXPECT_FALSE(all[0].empty());
}

}  // namespace
}  // namespace liquidblend::http
