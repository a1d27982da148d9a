#include "worker/jobs/attempt/traced_attempt.h"

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "tests/core/trace/fake_collector.h"
#include "tests/worker/jobs/jobs_testing.h"

namespace liquidblend::jobs {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;
using testing::UnorderedElementsAre;
using trace::CollectedSpan;

constexpr char kTraceId[] = "4bf92f3577b34da6a3ce929d0e0e4736";
constexpr char kParentId[] = "00f067aa0ba902b7";
const std::string kTraceparent = absl::StrCat("00-", kTraceId, "-", kParentId, "-01");

class TracedAttemptTest : public JobsTest {
 protected:
  // Of a call that is in the trace.
  std::string SubmitTraced(const std::vector<std::string>& targets,
                           const std::string& traceparent = kTraceparent) {
    store::pb::JobRecord job;
    job.set_traceparent(traceparent);
    job.set_tracestate("vendor=1");
    store::pb::RegisterJob& registration = *job.mutable_register_family();
    registration.set_family("balls");
    registration.set_source("a");
    for (const std::string& target : targets) registration.add_targets(target);
    registration.mutable_options()->set_max_iterations(3);
    const auto submitted = catalog_->SubmitRegistration(job);
    EXPECT_TRUE(submitted.ok()) << submitted.status();
    return submitted->id();
  }

  // The spans of all jobs in the queue.
  std::vector<CollectedSpan> WorkTraced() {
    trace::Tracer tracer(collector_.Options(), [](const std::string&) {});
    JobLoopOptions options = Options();
    options.tracer = &tracer;
    EXPECT_TRUE(WorkWith(options).ok());
    tracer.Stop(absl::Minutes(1));
    return collector_.Spans();
  }

  // Names of the stages of an attempt, in order.
  static std::vector<std::string> StagesOf(const CollectedSpan& attempt,
                                           std::vector<CollectedSpan> spans) {
    std::sort(spans.begin(), spans.end(), [](const CollectedSpan& a, const CollectedSpan& b) {
      return a.begin_ns < b.begin_ns;
    });
    std::vector<std::string> names;
    for (const CollectedSpan& span : spans) {
      if (span.parent_id == attempt.span_id) names.push_back(span.name);
    }
    return names;
  }

  trace::FakeCollector collector_;
};

TEST_F(TracedAttemptTest, AnAttemptIsASpanWithItsStagesInTheTraceOfTheCall) {
  for (const auto& [id, speed] : {std::pair("a", 0.0), {"b", 1.0}}) SubmitBall(id, speed);
  ASSERT_TRUE(Work().ok());
  const std::string job = SubmitTraced({"b"});
  const std::vector<CollectedSpan> spans = WorkTraced();
  const CollectedSpan attempt = trace::FindSpan(spans, "registration attempt");
  EXPECT_EQ(attempt.parent_id, kParentId);
  EXPECT_EQ(attempt.kind, 5);
  EXPECT_FALSE(attempt.has_failed);
  EXPECT_EQ(attempt.attributes.at("liquidblend.job"), job);
  EXPECT_EQ(attempt.attributes.at("liquidblend.job.attempt"), "1");
  EXPECT_EQ(attempt.attributes.at("liquidblend.job.queue_s"), "0.0");
  EXPECT_EQ(attempt.attributes.at("liquidblend.worker"), "test");
  EXPECT_EQ(attempt.attributes.at("liquidblend.resource"), "families/balls");
  EXPECT_THAT(StagesOf(attempt, spans),
              ElementsAre("space-time meshes", "registration", "projection", "levels of detail",
                          "publishing"));
  for (const CollectedSpan& span : spans) {
    EXPECT_EQ(span.trace_id, kTraceId);
    EXPECT_EQ(span.state, "vendor=1");
    EXPECT_LE(attempt.begin_ns, span.begin_ns);
    EXPECT_GE(attempt.end_ns, span.end_ns);
  }
}

TEST_F(TracedAttemptTest, EachTargetOfSeveralIsAnAttemptInTheSameTrace) {
  for (const auto& [id, speed] : {std::pair("a", 0.0), {"b", 1.0}, {"c", 2.0}}) {
    SubmitBall(id, speed);
  }
  ASSERT_TRUE(Work().ok());
  SubmitTraced({"b", "c"});
  const std::vector<CollectedSpan> spans = WorkTraced();
  std::vector<std::string> attempts;
  std::vector<std::string> targets;
  for (const CollectedSpan& span : spans) {
    EXPECT_EQ(span.trace_id, kTraceId);
    if (span.parent_id != kParentId) continue;
    attempts.push_back(span.name);
    const auto target = span.attributes.find("liquidblend.target_index");
    if (target != span.attributes.end()) targets.push_back(target->second);
  }
  EXPECT_THAT(attempts,
              UnorderedElementsAre("target registration attempt", "target registration attempt",
                                   "registration attempt"));
  EXPECT_THAT(targets, UnorderedElementsAre("0", "1"));
}

TEST_F(TracedAttemptTest, AFailureIsAnErrorOfTheAttemptAndOfTheStageThatFailed) {
  SubmitImport("ball", {{"f_0001.ply", std::vector<std::byte>(10)}});
  const std::vector<CollectedSpan> spans = WorkTraced();
  const CollectedSpan attempt = trace::FindSpan(spans, "import attempt");
  EXPECT_TRUE(attempt.has_failed);
  EXPECT_THAT(attempt.error, HasSubstr("f_0001.ply"));
  EXPECT_EQ(attempt.attributes.at("error.type"), "INVALID_ARGUMENT");
  EXPECT_THAT(StagesOf(attempt, spans), ElementsAre("opening files", "reading frames"));
  EXPECT_FALSE(trace::FindSpan(spans, "opening files").has_failed);
  EXPECT_TRUE(trace::FindSpan(spans, "reading frames").has_failed);
}

TEST_F(TracedAttemptTest, AJobThatNobodyTracesBeginsATraceOfItsOwn) {
  SubmitBall("ball", 1.0);
  const std::vector<CollectedSpan> spans = WorkTraced();
  EXPECT_EQ(trace::FindSpan(spans, "import attempt").parent_id, "");
}

TEST_F(TracedAttemptTest, AJobWhoseTraceIsNotSampledMakesNoSpans) {
  for (const auto& [id, speed] : {std::pair("a", 0.0), {"b", 1.0}}) SubmitBall(id, speed);
  ASSERT_TRUE(Work().ok());
  SubmitTraced({"b"}, absl::StrCat("00-", kTraceId, "-", kParentId, "-00"));
  EXPECT_THAT(WorkTraced(), IsEmpty());
}

TEST_F(TracedAttemptTest, ARecordThatIsDamagedHarmsNoJob) {
  for (const auto& [id, speed] : {std::pair("a", 0.0), {"b", 1.0}}) SubmitBall(id, speed);
  ASSERT_TRUE(Work().ok());
  const std::string job = SubmitTraced({"b"}, "nonsense");
  EXPECT_EQ(trace::FindSpan(WorkTraced(), "registration attempt").parent_id, "");
  EXPECT_EQ(Job(job).state(), store::pb::JobRecord::SUCCEEDED);
}

TEST_F(TracedAttemptTest, TheNextAttemptHasItsNumberAndItsTimeInTheQueue) {
  trace::Tracer tracer(collector_.Options(), [](const std::string&) {});
  store::pb::JobRecord job;
  job.mutable_register_target()->set_family("balls");
  job.mutable_register_target()->set_target_index(1);
  job.set_traceparent(kTraceparent);
  job.set_attempts(2);
  job.set_environment_failures(1);
  job.set_losses_after_progress(1);
  job.mutable_create_time()->set_seconds(1000);
  job.mutable_queue_time()->set_seconds(2000);
  job.mutable_start_time()->set_seconds(2003);
  TracedAttempt attempt(&tracer, job, "farm:7");
  attempt.BeginStage("registration");
  attempt.NoteResumed(12);
  attempt.End(absl::UnavailableError("the worker is stopping"));
  tracer.Stop(absl::Minutes(1));
  const std::vector<CollectedSpan> spans = collector_.Spans();
  const CollectedSpan one = trace::FindSpan(spans, "target registration attempt");
  EXPECT_EQ(one.attributes.at("liquidblend.job.attempt"), "4");
  EXPECT_EQ(one.attributes.at("liquidblend.job.queue_s"), "3.0");
  EXPECT_EQ(one.attributes.at("error.type"), "UNAVAILABLE");
  EXPECT_THAT(trace::FindSpan(spans, "registration").events,
              ElementsAre("resumed from a checkpoint"));
}

TEST_F(TracedAttemptTest, LinesOfTheLogHaveTheTraceOfTheirJob) {
  store::pb::JobRecord job;
  EXPECT_THAT(TraceFields(job), SizeIs(0));
  job.set_traceparent(kTraceparent);
  EXPECT_THAT(TraceFields(job), ElementsAre(testing::Pair("trace_id", kTraceId)));
}

}  // namespace
}  // namespace liquidblend::jobs
