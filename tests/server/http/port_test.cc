#include "server/http/port.h"

#include <nlohmann/json.hpp>
#include <thread>
#include <vector>

#include "absl/strings/escaping.h"
#include "absl/synchronization/notification.h"
#include "absl/time/clock.h"
#include "server/api/handlers.h"
#include "tests/server/http/port_testing.h"

namespace liquidblend::http::port_test {
namespace {

using store::Fails;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

constexpr char kSplash[] = "/v1/families/splash/frame.drc?weights=0.5&time=0.1";

TEST_F(PortTest, AFrameIsTheSameBytesAsByGrpcsMethod) {
  v1::GetFrameRequest request;
  request.set_family("families/splash");
  request.add_weights(0.5);
  request.set_time_s(0.1);
  const auto frame = server::GetFrame(backends_, request);
  ASSERT_TRUE(frame.ok()) << frame.status();
  HttpReply reply = HttpClient(port_->port()).Get(kSplash);
  EXPECT_EQ(reply.code, 200);
  EXPECT_EQ(reply.body, frame->data());
  EXPECT_EQ(reply.headers["x-liquidblend-triangles"], absl::StrCat(frame->num_triangles()));
  EXPECT_EQ(reply.headers["server"], "liquidblend");
  EXPECT_THAT(reply.headers["date"], HasSubstr(" GMT"));
}

TEST_F(PortTest, HeadIsGetWithoutTheBytes) {
  HttpClient client(port_->port());
  HttpReply get = client.Get(kSplash);
  HttpReply head = client.Request("HEAD", kSplash);
  EXPECT_EQ(head.code, 200);
  EXPECT_EQ(head.headers["content-length"], absl::StrCat(get.body.size()));
  EXPECT_EQ(head.headers["etag"], get.headers["etag"]);
  EXPECT_EQ(client.Get("/healthz").body, "ok\n");  // no byte of a body was sent
}

TEST_F(PortTest, WhatTheClientHasIsNotSentAgain) {
  HttpClient client(port_->port());
  HttpReply first = client.Get(kSplash);
  const std::string known = absl::StrCat("If-None-Match: ", first.headers["etag"], "\r\n");
  const HttpReply again = client.Get(kSplash, known);
  EXPECT_EQ(again.code, 304);
  EXPECT_FALSE(again.headers.contains("content-length"));
  EXPECT_EQ(client.Get(absl::StrCat(kSplash, "&version=1"), known).code, 304);
  EXPECT_EQ(client.Get("/v1/families/drops/frame.drc?weights=0.5&time=0.1", known).code, 200);
  EXPECT_THAT(MetricsText(),
              HasSubstr("liquidblend_frames_total{family=\"splash\",preset=\"fastest\"} 1\n"));
  PublishFamily("splash", "a", "b", 3);
  // Served as soon as it is in memory.
  const absl::Time give_up = absl::Now() + absl::Seconds(10);
  HttpReply newer;
  while (newer.headers["x-liquidblend-version"] != "2" && absl::Now() < give_up) {
    newer = client.Get(kSplash, known);
  }
  EXPECT_EQ(newer.code, 200);
  EXPECT_EQ(newer.headers["x-liquidblend-version"], "2");
}

TEST_F(PortTest, ANewerVersionThatIsAskedForIsWaitedFor) {
  HttpClient client(port_->port());
  HttpReply first = client.Get(kSplash);
  const std::string known = absl::StrCat("If-None-Match: ", first.headers["etag"], "\r\n");
  PublishFamily("splash", "a", "b", 3);
  for (const std::string& headers : {std::string(), known}) {
    HttpReply newer = client.Get(absl::StrCat(kSplash, "&min_version=2"), headers);
    EXPECT_EQ(newer.code, 200);
    EXPECT_EQ(newer.headers["x-liquidblend-version"], "2");
  }
  EXPECT_EQ(client.Get(absl::StrCat(kSplash, "&min_version=3")).code, 404);
}

TEST_F(PortTest, FamiliesAreListedAsJson) {
  HttpClient client(port_->port());
  const auto all = nlohmann::json::parse(client.Get("/v1/families").body);
  ASSERT_EQ(all["families"].size(), 2U);
  EXPECT_EQ(all["families"][0]["name"], "families/drops");
  const auto one = nlohmann::json::parse(client.Get("/v1/families/splash").body);
  EXPECT_EQ(one["version"], "1");
  EXPECT_EQ(one["targets"][0], "animations/b");
}

TEST_F(PortTest, MistakesAreToldByName) {
  HttpClient client(port_->port());
  const HttpReply weights = client.Get("/v1/families/splash/frame.drc?weights=0.5,0.5");
  EXPECT_EQ(weights.code, 400);
  EXPECT_THAT(weights.body, HasSubstr("weights"));
  EXPECT_EQ(client.Get("/v1/families/splash/frame.drc?weights=1&time=99").code, 400);
  EXPECT_EQ(client.Get("/v1/families/splash/frame.drc?weights=1&version=9").code, 404);
  EXPECT_EQ(client.Get("/v1/families/none/frame.drc").code, 404);
  EXPECT_EQ(client.Get("/v1/families/..%2F..%2Fetc/frame.drc").code, 400);
  EXPECT_EQ(client.Get("/etc/passwd").code, 404);
  EXPECT_EQ(client.Get("/healthz").code, 200);  // all on one connection
}

TEST_F(PortTest, BodiesThatNobodyTakesEndTheConnection) {
  {
    HttpClient client(port_->port());
    HttpReply reply = client.Request("POST", kSplash, "Content-Length: 5\r\n");
    EXPECT_EQ(reply.code, 405);
    EXPECT_EQ(reply.headers["allow"], "GET, HEAD, OPTIONS");
    EXPECT_TRUE(client.IsClosed());
  }
  HttpClient client(port_->port());
  const HttpReply reply = client.Request("GET", kSplash, "Transfer-Encoding: chunked\r\n");
  EXPECT_EQ(reply.code, 413);
  EXPECT_TRUE(client.IsClosed());
}

TEST_F(PortTest, PipelinedRequestsAreAnsweredInOrder) {
  HttpClient client(port_->port());
  std::string requests;
  for (const char* target : {kSplash, "/healthz", "/nowhere", "/v1/families/drops", kSplash}) {
    absl::StrAppend(&requests, "GET ", target, " HTTP/1.1\r\nHost: localhost\r\n\r\n");
  }
  ASSERT_TRUE(client.Send(requests));
  const HttpReply first = client.ReadReply();
  EXPECT_EQ(first.body.substr(0, 5), "DRACO");
  EXPECT_EQ(client.ReadReply().body, "ok\n");
  EXPECT_EQ(client.ReadReply().code, 404);
  EXPECT_THAT(client.ReadReply().body, HasSubstr("families/drops"));
  EXPECT_EQ(client.ReadReply().body, first.body);
}

TEST_F(PortTest, WhoWantsToCloseIsObeyed) {
  HttpClient modern(port_->port());
  EXPECT_EQ(modern.Get("/healthz", "Connection: close\r\n").body, "ok\n");
  EXPECT_TRUE(modern.IsClosed());
  HttpClient old(port_->port());
  ASSERT_TRUE(old.Send("GET /healthz HTTP/1.0\r\n\r\n"));
  EXPECT_EQ(old.ReadReply().body, "ok\n");
  EXPECT_TRUE(old.IsClosed());
}

TEST_F(PortTest, GarbageIsRefusedAndTheServerLives) {
  for (const std::string& garbage :
       {std::string("\r\n\r\n\r\n"), std::string("GET\r\n\r\n"),
        std::string("GET / HTTP/9.9\r\n\r\n"), std::string("PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"),
        std::string("\x16\x03\x01\x02\x00\x01\x00\x01\xfc"
                    "\x03\x03\r\n\r\n",
                    15),
        std::string("GET / HTTP/1.1\r\nHost\r\n\r\n"), std::string(100, '\0') + "\r\n\r\n",
        std::string("GET / HTTP/1.1\r\nContent-Length: -1\r\n\r\n"),
        std::string("GET / HTTP/1.1\r\nContent-Length: 1\r\nContent-Length: 2\r\n\r\n")}) {
    HttpClient client(port_->port());
    ASSERT_TRUE(client.Send(garbage));
    EXPECT_EQ(client.ReadReply().code, 400) << absl::CHexEscape(garbage);
    EXPECT_TRUE(client.IsClosed());
  }
  EXPECT_EQ(HttpClient(port_->port()).Get("/healthz").code, 200);
}

TEST_F(PortTest, HugeHeadersAreRefused) {
  HttpClient client(port_->port());
  const std::string huge = absl::StrCat("X-Long: ", std::string(100'000, 'a'), "\r\n");
  EXPECT_EQ(client.Get("/healthz", huge).code, 431);
  HttpClient other(port_->port());
  EXPECT_EQ(other.Get(absl::StrCat("/", std::string(20'000, 'a'))).code, 431);
}

TEST_F(PortTest, SlowClientsAreDisconnected) {
  PortOptions options;
  options.idle_timeout = absl::Milliseconds(200);
  Start(options);
  HttpClient silent(port_->port());
  EXPECT_TRUE(silent.IsClosed());
  HttpClient slow(port_->port());  // a byte now and then does not help
  const std::string request = "GET /healthz HTTP/1.1\r\nHost: localhost\r\n";
  const absl::Time begin = absl::Now();
  size_t num_sent = 0;
  while (num_sent < 10 * request.size() &&
         slow.Send(request.substr(num_sent % request.size(), 1))) {
    ++num_sent;
    absl::SleepFor(absl::Milliseconds(20));
  }
  EXPECT_TRUE(slow.IsClosed());
  EXPECT_LT(absl::Now() - begin, absl::Seconds(5));
}

TEST_F(PortTest, AClientThatDoesNotReadIsDisconnected) {
  PortOptions options;
  options.write_timeout = absl::Milliseconds(200);
  options.idle_timeout = absl::Milliseconds(500);
  Start(options);
  HttpClient client(port_->port());
  const std::string request = absl::StrCat("GET ", kSplash, " HTTP/1.1\r\nHost: localhost\r\n\r\n");
  const absl::Time begin = absl::Now();
  while (client.Send(request) && absl::Now() - begin < absl::Seconds(20)) {
  }
  EXPECT_LT(absl::Now() - begin, absl::Seconds(20));
}

TEST_F(PortTest, ManyConnectionsAreServedAtOnce) {
  std::vector<std::string> bodies(32);
  {
    std::vector<std::jthread> clients;
    for (size_t i = 0; i < bodies.size(); ++i) {
      clients.emplace_back([&, i] {
        HttpClient client(port_->port());
        for (int k = 0; k < 5; ++k) {
          bodies[i] =
              client.Get(i % 2 == 0 ? kSplash : "/v1/families/drops/frame.drc?weights=0.5&time=0.1")
                  .body;
        }
      });
    }
  }
  EXPECT_FALSE(bodies[0].empty());
  EXPECT_NE(bodies[0], bodies[1]);
  for (size_t i = 0; i < bodies.size(); ++i) EXPECT_EQ(bodies[i], bodies[i % 2]);
  const std::string text = MetricsText();  // each frame was made once
  EXPECT_THAT(text, HasSubstr("frames_total{family=\"splash\",preset=\"fastest\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("frames_total{family=\"drops\",preset=\"fastest\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("liquidblend_frame_cache_frames 2\n"));
}

TEST_F(PortTest, ThereAreOnlySoManyConnections) {
  PortOptions options;
  options.max_connections = 2;
  Start(options);
  HttpClient first(port_->port());
  EXPECT_EQ(first.Get("/healthz").code, 200);
  {
    HttpClient second(port_->port());
    EXPECT_EQ(second.Get("/healthz").code, 200);
    HttpClient third(port_->port());
    EXPECT_TRUE(third.IsClosed());
  }
  while (HttpClient(port_->port()).Get("/healthz").code != 200) std::this_thread::yield();
  EXPECT_THAT(first.Get("/metrics").body,
              HasSubstr("\nliquidblend_http_connections{kind=\"http\"} "));
}

TEST_F(PortTest, MetricsCountWorkersThatAreRefused) {
  store::pb::WorkerRecord worker;
  worker.set_name("host:1");
  worker.set_refusal("HTTP status 403");
  ASSERT_TRUE(catalog_->RecordWorker(worker).ok());
  EXPECT_THAT(HttpClient(port_->port()).Get("/metrics").body,
              HasSubstr("liquidblend_workers{state=\"refused\"} 1\n"));
}

TEST_F(PortTest, MetricsTellOfFamiliesJobsAndTheProcess) {
  HttpClient client(port_->port());
  client.Get(kSplash);
  const std::string text = client.Get("/metrics").body;
  EXPECT_THAT(text, HasSubstr("liquidblend_family_bytes{family=\"splash\"} "));
  EXPECT_THAT(text, HasSubstr("liquidblend_families_loaded 1\n"));
  EXPECT_THAT(text, HasSubstr("liquidblend_jobs{state=\"succeeded\"} 4\n"));
  EXPECT_THAT(text, HasSubstr("liquidblend_jobs{state=\"queued\"} 0\n"));
  EXPECT_THAT(text,
              HasSubstr("liquidblend_jobs_within_memory{memory=\"any\",state=\"queued\"} 0\n"));
  EXPECT_THAT(text, HasSubstr("liquidblend_workers{state=\"refused\"} 0\n"));
  EXPECT_THAT(text, HasSubstr("liquidblend_waiting_calls{pool=\"io\"} 0\n"));
  EXPECT_THAT(text, HasSubstr("liquidblend_frame_queue_cells 0\n"));
  EXPECT_THAT(text, HasSubstr("liquidblend_frames_refused_total 0\n"));
  EXPECT_THAT(text, HasSubstr("liquidblend_frame_cache_misses_total 1\n"));
  EXPECT_THAT(text, HasSubstr("liquidblend_frame_stage_seconds_count{stage=\"slice\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("liquidblend_frame_stage_seconds_count{stage=\"queue\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("liquidblend_frame_stage_seconds_count{stage=\"write\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("process_resident_memory_bytes "));
  EXPECT_THAT(text, HasSubstr("liquidblend_store_reachable{store=\"catalog\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("liquidblend_store_reachable{store=\"blobs\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("liquidblend_owner_stored_bytes{owner=\"(nobody)\"} "));
  EXPECT_THAT(text, HasSubstr("liquidblend_oldest_queued_job_seconds 0\n"));
  EXPECT_THAT(text, Not(HasSubstr("liquidblend_tls_")));
}

TEST_F(PortTest, MetricsCountJobsThatEndBetweenThem) {
  HttpClient(port_->port()).Get("/metrics");
  ImportAnimation("c");
  // The catalog is asked every 5 s.
  const absl::Time deadline = absl::Now() + absl::Seconds(60);
  while (!absl::StrContains(MetricsText(), "jobs_ended_total{code=\"OK\",kind=\"import\"} 1\n")) {
    ASSERT_LT(absl::Now(), deadline);
  }
}

TEST_F(PortTest, DrainingTellsProbesFirst) {
  HttpClient client(port_->port());
  EXPECT_EQ(client.Get("/readyz").code, 200);
  port_->Drain();
  EXPECT_EQ(client.Get("/readyz").code, 503);
  EXPECT_EQ(client.Get("/healthz").code, 200);
  EXPECT_EQ(client.Get(kSplash).code, 200);
  port_->Stop(absl::Seconds(10));
  EXPECT_TRUE(client.IsClosed());
  EXPECT_FALSE(HttpClient(port_->port()).is_connected());
}

TEST_F(PortTest, WhatIsBeingAnsweredIsFinishedOnStop) {
  OccupyFrames();
  std::vector<HttpReply> replies(2);
  {
    std::vector<std::jthread> threads;
    for (size_t i = 0; i < replies.size(); ++i) {
      const int64_t before = WaitingCost();
      threads.emplace_back([&, i] { replies[i] = HttpClient(port_->port()).Get(kSplash); });
      while (WaitingCost() == before) std::this_thread::yield();
    }
    threads.emplace_back([&] { port_->Stop(absl::Seconds(30)); });
    while (HttpClient(port_->port()).is_connected()) std::this_thread::yield();
    release_.Notify();
  }
  for (const HttpReply& reply : replies) EXPECT_EQ(reply.code, 200);
}

TEST_F(PortTest, AFrameThatItsClientHasLeftIsNotMade) {
  OccupyFrames();
  const std::string request = absl::StrCat("GET ", kSplash, " HTTP/1.1\r\nHost: localhost\r\n\r\n");
  for (int num_requests = 1; num_requests <= 2; ++num_requests) {
    {
      HttpClient client(port_->port());
      for (int i = 0; i < num_requests; ++i) ASSERT_TRUE(client.Send(request));
      while (WaitingCost() == 0) std::this_thread::yield();
    }
    const absl::Time give_up = absl::Now() + absl::Seconds(10);
    while (WaitingCost() > 0 && absl::Now() < give_up) std::this_thread::yield();
    EXPECT_EQ(WaitingCost(), 0) << "after " << num_requests;
  }
  release_.Notify();
  // The call is counted a moment after its frame is given up.
  const std::string both_left =
      "code=\"499\",method=\"GET /v1/families/{family}/frame.drc\",protocol=\"http\"} 2\n";
  std::string text = MetricsText();
  const absl::Time give_up = absl::Now() + absl::Seconds(10);
  while (!absl::StrContains(text, both_left) && absl::Now() < give_up) text = MetricsText();
  EXPECT_THAT(text, HasSubstr(both_left));
  EXPECT_THAT(text, Not(HasSubstr("liquidblend_frames_total{")));
}

TEST_F(PortTest, WhoLeavesDoesNotTakeTheFrameFromOthers) {
  OccupyFrames();
  HttpReply reply;
  {
    HttpClient leaver(port_->port());
    leaver.Send(absl::StrCat("GET ", kSplash, " HTTP/1.1\r\nHost: localhost\r\n\r\n"));
    while (WaitingCost() == 0) std::this_thread::yield();
    const int64_t one = WaitingCost();
    const std::jthread stayer([&] { reply = HttpClient(port_->port()).Get(kSplash); });
    while (WaitingCost() == one) std::this_thread::yield();
    leaver.Close();
    while (WaitingCost() != one) std::this_thread::yield();
    release_.Notify();
  }
  EXPECT_EQ(reply.code, 200);
}

TEST_F(PortTest, APoolThatHasStoppedIsUnavailable) {
  backends_.frames.Stop();
  HttpReply reply = HttpClient(port_->port()).Get(kSplash);
  EXPECT_EQ(reply.code, 503);
  EXPECT_EQ(reply.headers["retry-after"], "1");
  EXPECT_THAT(reply.body, HasSubstr("shutting down"));
}

TEST_F(PortTest, APortInUseIsRefusedByName) {
  PortOptions options;
  options.listen = port_->address();
  EXPECT_THAT(Port::Start(*api_, options).status(),
              Fails(absl::StatusCode::kFailedPrecondition, port_->address()));
  options.listen = "no.such.host.invalid:80";
  EXPECT_THAT(Port::Start(*api_, options).status(),
              Fails(absl::StatusCode::kFailedPrecondition, "no.such.host.invalid"));
}

TEST(PortOptions, NamesTheFirstFieldOutOfRange) {
  const auto message = [](auto change) {
    PortOptions options;
    change(options);
    return std::string(options.Validate().message());
  };
  EXPECT_TRUE(PortOptions().Validate().ok());
  EXPECT_THAT(message([](auto& o) { o.listen = "8080"; }), HasSubstr("listen"));
  EXPECT_THAT(message([](auto& o) { o.num_threads = 0; }), HasSubstr("num_threads"));
  EXPECT_THAT(message([](auto& o) { o.max_connections = 0; }), HasSubstr("max_connections"));
  EXPECT_THAT(message([](auto& o) { o.max_header_bytes = 10; }), HasSubstr("max_header_bytes"));
  EXPECT_THAT(message([](auto& o) { o.max_message_bytes = 10; }), HasSubstr("max_message_bytes"));
  EXPECT_THAT(message([](auto& o) { o.router.max_body_bytes = 0; }), HasSubstr("max_body_bytes"));
  EXPECT_THAT(message([](auto& o) { o.router.max_bodies_bytes = 0; }),
              HasSubstr("max_bodies_bytes"));
  EXPECT_THAT(message([](auto& o) { o.router.max_answers_bytes = 0; }),
              HasSubstr("max_answers_bytes"));
  EXPECT_THAT(message([](auto& o) { o.idle_timeout = absl::ZeroDuration(); }),
              HasSubstr("idle_timeout"));
  EXPECT_THAT(message([](auto& o) { o.write_timeout = absl::ZeroDuration(); }),
              HasSubstr("write_timeout"));
  EXPECT_THAT(message([](auto& o) { o.close_timeout = absl::ZeroDuration(); }),
              HasSubstr("close_timeout"));
  for (const char* origin :
       {"example.org", "https://", "https://a/b", "https://a\r\nX: y", "://a"}) {
    EXPECT_THAT(message([&](auto& o) { o.router.allowed_origin = origin; }),
                HasSubstr("allowed_origin"));
  }
  for (const char* host : {"", "a:80", "http://a", "a b"}) {
    EXPECT_THAT(message([&](auto& o) { o.router.hosts = {host}; }), HasSubstr("hosts"));
  }
}

}  // namespace
}  // namespace liquidblend::http::port_test
