// Spans of requests, as a collector gets them.
#include <algorithm>
#include <string>
#include <vector>

#include "absl/strings/match.h"
#include "absl/time/clock.h"
#include "tests/core/trace/fake_collector.h"
#include "tests/server/http/port_testing.h"

namespace liquidblend::http {
namespace {

using testing::IsEmpty;
using testing::IsSupersetOf;
using trace::CollectedSpan;

constexpr char kTrace[] =
    "traceparent: 00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01\r\n";
constexpr char kTraceId[] = "4bf92f3577b34da6a3ce929d0e0e4736";
constexpr char kParentId[] = "00f067aa0ba902b7";
constexpr char kTracedFrame[] = "/v1/families/splash/frame.drc?weights=0.5&time=0.1";
constexpr char kTracedFrameRoute[] = "GET /v1/families/{family}/frame.drc";

// What the backends need, before there are any.
struct Traced {
  trace::FakeCollector collector;
  std::shared_ptr<trace::Tracer> tracer =
      std::make_shared<trace::Tracer>(collector.Options(), [](const std::string&) {});
};

class TraceTest : protected Traced, public PortTest {
 protected:
  TraceTest() : PortTest(WithTracer(tracer)) {}

  static server::BackendsOptions WithTracer(std::shared_ptr<const trace::Tracer> used) {
    server::BackendsOptions options = Options();
    options.tracer = std::move(used);
    return options;
  }

  // All spans, once the port has ended.
  std::vector<CollectedSpan> EndedSpans() {
    port_.reset();
    backends_.Stop();
    tracer->Stop(absl::Minutes(1));
    return collector.Spans();
  }

  static std::vector<std::string> ChildrenOf(const CollectedSpan& parent,
                                             const std::vector<CollectedSpan>& spans) {
    std::vector<std::string> names;
    for (const CollectedSpan& span : spans) {
      if (span.parent_id == parent.span_id) names.push_back(span.name);
    }
    return names;
  }
};

TEST_F(TraceTest, AFrameIsASpanOfTheClientsTraceWithItsStages) {
  const std::string headers =
      absl::StrCat(kTrace, "tracestate: a=1\r\ntracestate: b=2\r\nX-Request-Id: r1\r\n");
  ASSERT_EQ(HttpClient(port_->port()).Get(kTracedFrame, headers).code, 200);
  const std::vector<CollectedSpan> spans = EndedSpans();
  const CollectedSpan call = trace::FindSpan(spans, kTracedFrameRoute);
  EXPECT_EQ(call.trace_id, kTraceId);
  EXPECT_EQ(call.parent_id, kParentId);
  EXPECT_EQ(call.state, "a=1, b=2");
  EXPECT_EQ(call.kind, 2);
  EXPECT_FALSE(call.has_failed);
  const std::map<std::string, std::string> expected = {
      {"http.request.method", "GET"},         {"http.route", "/v1/families/{family}/frame.drc"},
      {"http.response.status_code", "200"},   {"liquidblend.request_id", "r1"},
      {"liquidblend.principal", "anonymous"}, {"liquidblend.resource", "families/splash"},
      {"liquidblend.family", "splash"},       {"liquidblend.family.version", "1"},
      {"liquidblend.frame.source", "made"}};
  EXPECT_EQ(call.attributes, expected);
  EXPECT_THAT(ChildrenOf(call, spans), IsSupersetOf({"queue", "slice", "encode", "write"}));
}

TEST_F(TraceTest, AMethodIsASpanAndAClientsMistakeIsNoError) {
  HttpClient client(port_->port());
  EXPECT_EQ(client.Get("/v1/families/none", kTrace).code, 404);
  EXPECT_EQ(client.Get("/v1/families", kTrace).code, 200);
  const std::vector<CollectedSpan> spans = EndedSpans();
  const CollectedSpan lost = trace::FindSpan(spans, "GET /v1/families/{family}");
  EXPECT_EQ(lost.attributes.at("http.response.status_code"), "404");
  EXPECT_EQ(lost.attributes.at("liquidblend.resource"), "families/none");
  EXPECT_FALSE(lost.has_failed);
  EXPECT_EQ(trace::FindSpan(spans, "GET /v1/families").parent_id, kParentId);
}

TEST_F(TraceTest, AServersFaultIsAnErrorOfTheSpan) {
  backends_.Stop();
  EXPECT_EQ(HttpClient(port_->port()).Get("/v1/families", kTrace).code, 503);
  const CollectedSpan call = trace::FindSpan(EndedSpans(), "GET /v1/families");
  EXPECT_TRUE(call.has_failed);
  EXPECT_THAT(call.error, testing::HasSubstr("shutting down"));
}

TEST_F(TraceTest, ProbesAndWhatNoMethodAnswersMakeNoSpans) {
  HttpClient client(port_->port());
  for (const char* target : {"/healthz", "/readyz", "/metrics", "/", "/nowhere", "/v1/stream"}) {
    client.Get(target, kTrace);
  }
  EXPECT_EQ(client.Request("OPTIONS", kTracedFrame, kTrace).code, 204);
  EXPECT_EQ(client.Request("PUT", kTracedFrame, kTrace).code, 405);
  EXPECT_THAT(EndedSpans(), IsEmpty());
}

TEST_F(TraceTest, AWebSocketIsOneSpanWithTheStagesOfItsFirstFrame) {
  HttpClient client(port_->port());
  ASSERT_EQ(client.Upgrade(kTrace).code, 101);
  v1::StreamFramesRequest request;
  request.set_family("families/splash");
  request.add_weights(0.5);
  request.set_lossless(true);
  ASSERT_TRUE(client.SendMessage(2, request.SerializeAsString()));
  while (client.ReadMessage().opcode == 2) {
  }
  client.Close();
  const std::vector<CollectedSpan> spans = EndedSpans();
  const CollectedSpan call = trace::FindSpan(spans, "GET /v1/stream");
  EXPECT_EQ(call.parent_id, kParentId);
  EXPECT_EQ(call.attributes.at("http.response.status_code"), "1000");
  EXPECT_EQ(call.attributes.at("liquidblend.frames.sent"), absl::StrCat(server::kFamilyFrames));
  EXPECT_FALSE(call.has_failed);
  const std::vector<std::string> children = ChildrenOf(call, spans);
  EXPECT_EQ(std::count(children.begin(), children.end(), "slice"), 1);
}

TEST_F(TraceTest, WhatIsNotATraceparentIsIgnored) {
  HttpClient client(port_->port());
  EXPECT_EQ(client.Get(kTracedFrame, "traceparent: nonsense\r\n").code, 200);
  EXPECT_EQ(client.Get(kTracedFrame, absl::StrCat(kTrace, kTrace)).code, 200);
  int num_calls = 0;
  for (const CollectedSpan& span : EndedSpans()) {
    if (span.name != kTracedFrameRoute) continue;
    ++num_calls;
    EXPECT_EQ(span.parent_id, "");
    EXPECT_NE(span.trace_id, kTraceId);
  }
  EXPECT_EQ(num_calls, 2);
}

TEST_F(TraceTest, TheMetricsHaveTheCountsOfSpans) {
  HttpClient client(port_->port());
  EXPECT_EQ(client.Get(kTracedFrame, kTrace).code, 200);
  collector.AwaitNames({kTracedFrameRoute});
  std::string text = MetricsText();
  // They are counted once the collector has answered.
  const absl::Time give_up = absl::Now() + absl::Minutes(1);
  while (absl::StrContains(text, "liquidblend_spans_exported_total 0\n")) {
    ASSERT_LT(absl::Now(), give_up);
    absl::SleepFor(absl::Milliseconds(10));
    text = MetricsText();
  }
  EXPECT_THAT(text, testing::ContainsRegex("liquidblend_spans_exported_total [1-9]"));
  for (const char* reason : {"rate", "queue", "collector"}) {
    EXPECT_THAT(text, testing::HasSubstr(absl::StrCat("liquidblend_spans_dropped_total{reason=\"",
                                                      reason, "\"} 0\n")));
  }
}

}  // namespace
}  // namespace liquidblend::http
