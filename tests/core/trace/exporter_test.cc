#include "core/trace/exporter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/synchronization/notification.h"
#include "tests/core/store/blobs/loopback_listener.h"
#include "tests/core/trace/fake_collector.h"

namespace liquidblend::trace {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;

// Longer than anything here takes, shorter than a request may.
constexpr absl::Duration kSoon = absl::Seconds(5);

class ExporterTest : public testing::Test {
 protected:
  void Start(TracerOptions options) {
    queue_ = std::make_shared<SpanQueue>(options.queue);
    exporter_ = std::make_unique<Exporter>(
        std::move(options), queue_, [this](const std::string& line) { lines_.push_back(line); });
  }

  void Push(const std::string& name) {
    SpanRecord span;
    span.context = {1, 2, RandomId(), true, ""};
    span.name = name;
    queue_->Push(std::move(span));
  }

  // What was reported by then.
  std::vector<std::string> Stop(absl::Duration patience = absl::Minutes(1)) {
    exporter_->Stop(patience);
    return lines_;
  }

  FakeCollector collector_;
  std::shared_ptr<SpanQueue> queue_;
  std::unique_ptr<Exporter> exporter_;
  std::vector<std::string> lines_;  // of the exporter's thread
};

TEST_F(ExporterTest, SendsWhatEndsAndAtTheEndTheRest) {
  TracerOptions options = collector_.Options();
  options.batch_spans = 2;
  Start(options);
  for (const char* name : {"a", "b"}) Push(name);
  collector_.AwaitNames({"a", "b"});
  for (const char* name : {"c", "d", "e"}) Push(name);
  EXPECT_THAT(Stop(), IsEmpty());
  EXPECT_THAT(collector_.Spans(), SizeIs(5));
  EXPECT_EQ(queue_->stats().num_exported, 5);
  EXPECT_EQ(queue_->stats().num_dropped(), 0);
}

TEST_F(ExporterTest, ARequestHasItsTypeAndTheHeadersThatAreGiven) {
  TracerOptions options = collector_.Options();
  options.headers = {{"Authorization", "Bearer secret"}};
  Start(options);
  Push("a");
  Stop();
  const std::map<std::string, std::string> headers = collector_.LastHeaders();
  EXPECT_EQ(headers.at("content-type"), "application/json");
  EXPECT_EQ(headers.at("authorization"), "Bearer secret");
}

TEST_F(ExporterTest, ACollectorThatIsAwayForAMomentLosesNothing) {
  collector_.FailNext(1, 503);
  Start(collector_.Options());
  Push("a");
  collector_.AwaitNames({"a"});
  EXPECT_THAT(Stop(), IsEmpty());
  EXPECT_EQ(collector_.num_requests(), 2);
}

TEST_F(ExporterTest, WhatIsRefusedIsDroppedCountedAndReported) {
  collector_.FailNext(1, 401);
  TracerOptions options = collector_.Options();
  const std::string address = collector_.url().substr(std::string("http://").size());
  options.url = absl::StrCat("http://user:password@", address, "/v1/traces?key=secret");
  Start(options);
  Push("a");
  EXPECT_THAT(Stop(), ElementsAre(AllOf(HasSubstr("1 spans dropped"),
                                        HasSubstr(absl::StrCat("http://", address, "/v1/traces")),
                                        HasSubstr("HTTP status 401"), Not(HasSubstr("password")),
                                        Not(HasSubstr("secret")))));
  EXPECT_EQ(queue_->stats().num_refused, 1);
  EXPECT_EQ(collector_.num_requests(), 1);
}

TEST_F(ExporterTest, SpansThatTheCollectorLeavesOutAreCounted) {
  store::HttpFake picky([](const store::HttpFake::Request&) {
    return store::HttpFake::Answer{200, R"({"partialSuccess":{"rejectedSpans":"1"}})"};
  });
  TracerOptions options = collector_.Options();
  options.url = picky.url() + "/v1/traces";
  Start(options);
  for (const char* name : {"a", "b", "c"}) Push(name);
  EXPECT_THAT(Stop(), ElementsAre(HasSubstr("did not take them")));
  EXPECT_EQ(queue_->stats().num_exported + queue_->stats().num_refused, 3);
  EXPECT_GE(queue_->stats().num_refused, 1);
}

TEST_F(ExporterTest, NobodyThereIsReportedOnceAndDelaysNoEnd) {
  int port = 0;
  {
    const store::LoopbackListener listener;
    port = listener.port();
  }
  TracerOptions options = collector_.Options();
  options.url = absl::StrCat("http://127.0.0.1:", port, "/v1/traces");
  Start(options);
  const absl::Time begin = absl::Now();
  for (int k = 0; k < 3000; ++k) Push("a");
  EXPECT_THAT(Stop(kSoon), ElementsAre(HasSubstr("not taken by http://127.0.0.1:")));
  EXPECT_LT(absl::Now() - begin, kSoon);
  EXPECT_EQ(queue_->stats().num_dropped(), 3000);
}

TEST_F(ExporterTest, ACollectorThatHangsDelaysTheEndByItsPatienceOnly) {
  absl::Notification asked;
  absl::Notification release;
  store::HttpFake hanging(store::HttpFake::RawHandler(
      [&](store::HttpFake::Connection&, const store::HttpFake::Request&) {
        asked.Notify();
        release.WaitForNotification();
      }));
  TracerOptions options = collector_.Options();
  options.url = hanging.url() + "/v1/traces";
  options.timeout = absl::Minutes(10);
  Start(options);
  Push("a");
  asked.WaitForNotification();
  Push("b");
  const absl::Time begin = absl::Now();
  EXPECT_THAT(Stop(absl::Milliseconds(10)), SizeIs(1));
  EXPECT_LT(absl::Now() - begin, kSoon);
  EXPECT_EQ(queue_->stats().num_exported, 0);
  release.Notify();
}

}  // namespace
}  // namespace liquidblend::trace
