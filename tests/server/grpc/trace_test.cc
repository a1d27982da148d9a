// Spans of calls, as a collector gets them.
#include <algorithm>
#include <fstream>
#include <map>
#include <set>

#include "absl/strings/str_cat.h"
#include "tests/core/trace/fake_collector.h"
#include "tests/server/grpc/server_testing.h"

namespace liquidblend::server {
namespace {

using testing::IsEmpty;
using testing::IsSupersetOf;
using testing::SizeIs;
using testing::UnorderedElementsAre;
using trace::CollectedSpan;

constexpr char kTraceId[] = "4bf92f3577b34da6a3ce929d0e0e4736";
constexpr char kParentId[] = "00f067aa0ba902b7";
constexpr char kGetFrame[] = "liquidblend.v1.LiquidBlend/GetFrame";

class TraceTest : public ServerTest {
 protected:
  TraceTest()
      : tracer_(std::make_shared<trace::Tracer>(collector_.Options(), [](const std::string&) {})) {}

  void SetUp() override {
    PublishSplash();
    ServerOptions options;
    options.tracer = tracer_;
    Start(options);
  }

  static std::string Traceparent() { return absl::StrCat("00-", kTraceId, "-", kParentId, "-01"); }

  // `headers`: of the call, name and value.
  grpc::Status GetFrame(const std::vector<std::pair<std::string, std::string>>& headers,
                        const std::string& family = "families/splash") {
    grpc::ClientContext context;
    for (const auto& [name, value] : headers) context.AddMetadata(name, value);
    v1::GetFrameRequest request;
    request.set_family(family);
    request.add_weights(0.5);
    v1::Frame frame;
    return stub_->GetFrame(&context, request, &frame);
  }

  // All spans, once the server has ended.
  std::vector<CollectedSpan> EndedSpans() {
    server_.reset();
    tracer_->Stop(absl::Minutes(1));
    return collector_.Spans();
  }

  static std::vector<std::string> ChildrenOf(const CollectedSpan& parent,
                                             const std::vector<CollectedSpan>& spans) {
    std::vector<std::string> names;
    for (const CollectedSpan& span : spans) {
      if (span.parent_id != parent.span_id) continue;
      EXPECT_EQ(span.trace_id, parent.trace_id);
      EXPECT_LE(span.begin_ns, span.end_ns);
      names.push_back(span.name);
    }
    return names;
  }

  trace::FakeCollector collector_;
  std::shared_ptr<trace::Tracer> tracer_;
};

TEST_F(TraceTest, ACallForAFrameIsASpanWithItsStagesInTheClientsTrace) {
  ASSERT_THAT(GetFrame({{"traceparent", Traceparent()},
                        {"tracestate", "vendor=1"},
                        {"x-request-id", "shot-17"}}),
              IsOk());
  const std::vector<CollectedSpan> spans = EndedSpans();
  const CollectedSpan call = trace::FindSpan(spans, kGetFrame);
  EXPECT_EQ(call.trace_id, kTraceId);
  EXPECT_EQ(call.parent_id, kParentId);
  EXPECT_EQ(call.state, "vendor=1");
  EXPECT_EQ(call.kind, 2);
  EXPECT_FALSE(call.has_failed);
  const std::map<std::string, std::string> expected = {
      {"rpc.system", "grpc"},
      {"rpc.service", "liquidblend.v1.LiquidBlend"},
      {"rpc.method", "GetFrame"},
      {"rpc.grpc.status_code", "0"},
      {"liquidblend.request_id", "shot-17"},
      {"liquidblend.principal", "anonymous"},
      {"liquidblend.resource", "families/splash"},
      {"liquidblend.family", "splash"},
      {"liquidblend.family.version", "1"},
      {"liquidblend.frame.source", "made"}};
  EXPECT_EQ(call.attributes, expected);
  const std::vector<std::string> children = ChildrenOf(call, spans);
  EXPECT_THAT(children, IsSupersetOf({"queue", "slice", "encode", "write"}));
  for (const char* stage : {"queue", "slice", "encode"}) {
    const CollectedSpan span = trace::FindSpan(spans, stage);
    EXPECT_GE(span.begin_ns, call.begin_ns) << stage;
    EXPECT_LE(span.end_ns, call.end_ns) << stage;
  }
}

TEST_F(TraceTest, AFrameOfTheCacheHasNoStages) {
  ASSERT_THAT(GetFrame({{"traceparent", "00-" + std::string(32, '1') + "-1111111111111111-00"}}),
              IsOk());  // not sampled
  ASSERT_THAT(GetFrame({{"traceparent", Traceparent()}}), IsOk());
  const std::vector<CollectedSpan> spans = EndedSpans();
  const CollectedSpan call = trace::FindSpan(spans, kGetFrame);
  EXPECT_EQ(call.attributes.at("liquidblend.frame.source"), "cache");
  std::vector<std::string> children = ChildrenOf(call, spans);
  std::erase(children, "find family");  // is told of if it takes a millisecond
  EXPECT_THAT(children, UnorderedElementsAre("write"));
}

TEST_F(TraceTest, WhatIsNotATraceparentIsIgnored) {
  ASSERT_THAT(GetFrame({{"traceparent", "nonsense"}, {"tracestate", "vendor=1"}}), IsOk());
  ASSERT_THAT(GetFrame({{"traceparent", Traceparent()}, {"traceparent", Traceparent()}}), IsOk());
  int num_calls = 0;
  for (const CollectedSpan& span : EndedSpans()) {
    if (span.name != kGetFrame) continue;
    ++num_calls;
    EXPECT_NE(span.trace_id, kTraceId);
    EXPECT_EQ(span.parent_id, "");
    EXPECT_EQ(span.state, "");
  }
  EXPECT_EQ(num_calls, 2);
}

TEST_F(TraceTest, AClientsMistakeIsNoErrorOfTheSpan) {
  ASSERT_FALSE(GetFrame({}, "families/none").ok());
  const CollectedSpan call = trace::FindSpan(EndedSpans(), kGetFrame);
  EXPECT_EQ(call.attributes.at("rpc.grpc.status_code"), "5");
  EXPECT_FALSE(call.has_failed);
}

TEST_F(TraceTest, AStreamIsOneSpanWithTheStagesOfItsFirstFrame) {
  grpc::ClientContext context;
  context.AddMetadata("traceparent", Traceparent());
  auto stream = stub_->StreamFrames(&context);
  ASSERT_TRUE(stream->Write(Lossless()));
  stream->WritesDone();
  v1::StreamFramesResponse response;
  int num_frames = 0;
  while (stream->Read(&response)) ++num_frames;
  ASSERT_THAT(stream->Finish(), IsOk());
  const std::vector<CollectedSpan> spans = EndedSpans();
  const CollectedSpan call = trace::FindSpan(spans, "liquidblend.v1.LiquidBlend/StreamFrames");
  EXPECT_EQ(call.parent_id, kParentId);
  EXPECT_EQ(call.attributes.at("liquidblend.frames.sent"), absl::StrCat(num_frames));
  EXPECT_EQ(call.attributes.at("liquidblend.frames.skipped"), "0");
  const std::vector<std::string> children = ChildrenOf(call, spans);
  EXPECT_EQ(std::count(children.begin(), children.end(), "slice"), 1);
}

TEST_F(TraceTest, AJobKeepsTheSpanOfTheCallThatAskedForIt) {
  grpc::ClientContext context;
  context.AddMetadata("traceparent", Traceparent());
  v1::RegisterFamilyRequest request;
  request.set_family_id("next");
  request.set_source("animations/a");
  request.add_targets("animations/b");
  Operation operation;
  ASSERT_THAT(stub_->RegisterFamily(&context, request, &operation), IsOk());
  const store::pb::JobRecord job = catalog_->ListJobs(1, "")->records[0];
  const CollectedSpan call =
      trace::FindSpan(EndedSpans(), "liquidblend.v1.LiquidBlend/RegisterFamily");
  EXPECT_EQ(job.traceparent(), absl::StrCat("00-", kTraceId, "-", call.span_id, "-01"));
  v1::RegisterFamilyMetadata metadata;
  ASSERT_TRUE(operation.metadata().UnpackTo(&metadata));
  EXPECT_EQ(metadata.progress().trace_id(), kTraceId);
}

TEST_F(TraceTest, WithoutATracerAJobKeepsTheClientsSpan) {
  Start(ServerOptions());
  grpc::ClientContext context;
  context.AddMetadata("traceparent", Traceparent());
  v1::RegisterFamilyRequest request;
  request.set_family_id("next");
  request.set_source("animations/a");
  request.add_targets("animations/b");
  Operation operation;
  ASSERT_THAT(stub_->RegisterFamily(&context, request, &operation), IsOk());
  EXPECT_EQ(catalog_->ListJobs(1, "")->records[0].traceparent(), Traceparent());
  EXPECT_THAT(EndedSpans(), IsEmpty());
}

TEST_F(TraceTest, WhoeverHasNoTokenMakesNoSpans) {
  const NewToken made = *MakeToken("studio", {"frames"});
  const std::string path = folder_.path() + "/tokens.json";
  std::ofstream(path) << R"({"principals": [)" << made.entry << "]}";
  ServerOptions options;
  options.authorizer = *Authorizer::Open(path);
  options.tracer = tracer_;
  Start(options);
  for (int k = 0; k < 20; ++k) {
    EXPECT_EQ(GetFrame({{"traceparent", Traceparent()}}).error_code(),
              grpc::StatusCode::UNAUTHENTICATED);
  }
  EXPECT_THAT(GetFrame({{"authorization", absl::StrCat("Bearer ", made.token)}}), IsOk());
  const std::vector<CollectedSpan> spans = EndedSpans();
  int num_calls = 0;
  for (const CollectedSpan& span : spans) num_calls += span.name == kGetFrame;
  EXPECT_EQ(num_calls, 1);
  EXPECT_EQ(trace::FindSpan(spans, kGetFrame).attributes.at("liquidblend.principal"), "studio");
  for (const CollectedSpan& span : spans) {
    for (const auto& [name, value] : span.attributes) {
      EXPECT_EQ(value.find(made.token), std::string::npos) << name;
    }
  }
}

TEST_F(TraceTest, CallsAreAnsweredAlikeWhileTheCollectorIsAway) {
  collector_.FailNext(1000, 503);
  for (int k = 0; k < 5; ++k) {
    EXPECT_THAT(GetFrame({{"traceparent", Traceparent()}}), IsOk());
  }
  server_.reset();
  tracer_->Stop(absl::ZeroDuration());
  EXPECT_GT(tracer_->stats().num_refused, 0);
  EXPECT_EQ(tracer_->stats().num_exported, 0);
}

}  // namespace
}  // namespace liquidblend::server
