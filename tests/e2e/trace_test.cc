// Traces through the real programs: one tree from the command to the worker's stages.
#include <signal.h>

#include <algorithm>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/store/catalog/catalog.h"
#include "tests/core/store/blobs/loopback_listener.h"
#include "tests/core/trace/fake_collector.h"
#include "tests/e2e/e2e_testing.h"

namespace liquidblend::e2e {
namespace {

using testing::HasSubstr;
using testing::IsSupersetOf;
using testing::UnorderedElementsAre;
using trace::CollectedSpan;
using trace::FindSpan;
using Spans = std::vector<CollectedSpan>;

constexpr char kTraceId[] = "4bf92f3577b34da6a3ce929d0e0e4736";
constexpr char kParentId[] = "00f067aa0ba902b7";
constexpr char kRegisterCall[] = "liquidblend.v1.LiquidBlend/RegisterFamily";
constexpr char kWatchCall[] = "liquidblend.v1.LiquidBlend/WatchOperation";
constexpr char kFrameCall[] = "liquidblend.v1.LiquidBlend/GetFrame";

class TraceTest : public E2eTest {
 protected:
  TraceTest() { lease_ = "30s"; }

  // Runs the command; its environment has `environment`.
  Process Command(const std::vector<std::string>& arguments,
                  const std::vector<std::string>& environment) {
    std::vector<std::string> all = {"--server", Address()};
    all.insert(all.end(), arguments.begin(), arguments.end());
    return {"liquidblend", all, environment};
  }

  std::vector<std::string> Traced(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> all = trace::EnvironmentOf(collector_);
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }

  static std::vector<std::string> RegisterBalls(int num_iterations = 3) {
    return {"register", "balls", "--source",     "a",
            "--target", "b",     "--iterations", absl::StrCat(num_iterations),
            "--wait"};
  }
  // Takes seconds.
  static std::vector<std::string> RegisterBallsLong() {
    std::vector<std::string> arguments = RegisterBalls(200);
    arguments.insert(arguments.end(), {"--node-spacing", "1", "--sample-share", "1"});
    return arguments;
  }

  std::vector<std::string> GetBalls() const {
    return {"frame", "balls", "-w", "0.5", "-t", "0.1", "-o", data() + "/frame.drc"};
  }

  void ImportBoth() {
    ExpectSuccess(AwaitDone(ImportBall("a", 1.0).name()));
    ExpectSuccess(AwaitDone(ImportBall("b", 2.0).name()));
  }

  static Spans OfTrace(const std::string& trace_id, const Spans& spans) {
    Spans found;
    for (const CollectedSpan& span : spans) {
      if (span.trace_id == trace_id) found.push_back(span);
    }
    return found;
  }

  // Waits until there are spans of these names in the trace, and the parents of all of its spans
  // but for `outside`; returns them.
  Spans AwaitTree(const std::string& trace_id, const std::set<std::string>& names,
                  const std::string& outside = "") {
    return OfTrace(trace_id, collector_.Await([&](const Spans& all) {
      std::set<std::string> missing = names;
      std::set<std::string> ids = {"", outside};
      const Spans spans = OfTrace(trace_id, all);
      for (const CollectedSpan& span : spans) {
        missing.erase(span.name);
        ids.insert(span.span_id);
      }
      return missing.empty() && std::all_of(spans.begin(), spans.end(), [&](const auto& span) {
               return ids.contains(span.parent_id);
             });
    }));
  }

  static std::vector<std::string> ChildrenOf(const CollectedSpan& parent, const Spans& spans) {
    std::vector<std::string> names;
    for (const CollectedSpan& span : spans) {
      if (span.parent_id == parent.span_id) names.push_back(span.name);
    }
    return names;
  }

  trace::FakeCollector collector_;
};

TEST_F(TraceTest, OneTraceLeadsFromTheCommandToTheStagesOfTheWorker) {
  Process server = StartServer(1, Traced());
  ImportBoth();
  ASSERT_EQ(Command(RegisterBalls(), Traced()).Wait(), 0);
  const CollectedSpan root =
      FindSpan(collector_.AwaitNames({"liquidblend register"}), "liquidblend register");
  const Spans spans =
      AwaitTree(root.trace_id, {kRegisterCall, kWatchCall, "registration attempt", "publishing"});
  EXPECT_EQ(root.parent_id, "");
  EXPECT_EQ(root.service, "liquidblend");
  const CollectedSpan call = FindSpan(spans, kRegisterCall);
  EXPECT_EQ(call.parent_id, root.span_id);
  EXPECT_EQ(call.service, "liquidblend-server");
  EXPECT_THAT(ChildrenOf(root, spans), IsSupersetOf({kWatchCall}));
  EXPECT_THAT(ChildrenOf(call, spans), UnorderedElementsAre("registration attempt"));
  const CollectedSpan attempt = FindSpan(spans, "registration attempt");
  EXPECT_EQ(attempt.service, "liquidblend-worker");
  EXPECT_THAT(ChildrenOf(attempt, spans), IsSupersetOf({"space-time meshes", "registration",
                                                        "levels of detail", "publishing"}));
  for (const CollectedSpan& span : spans) EXPECT_FALSE(span.has_failed) << span.name;

  Process listed = Command({"operations", "--json"}, {});
  std::string text;
  for (std::string line = listed.ReadLine(); !line.empty(); line = listed.ReadLine()) text += line;
  EXPECT_EQ(listed.Wait(), 0);
  EXPECT_THAT(text, HasSubstr(absl::StrCat("\"traceId\": \"", root.trace_id, "\"")));
}

TEST_F(TraceTest, AFrameIsInTheTraceOfWhoeverRunsTheCommand) {
  Process server = StartServer(1, Traced());
  ImportBoth();
  ASSERT_EQ(Command(RegisterBalls(), {}).Wait(), 0);
  const std::string parent = absl::StrCat("TRACEPARENT=00-", kTraceId, "-", kParentId, "-01");
  ASSERT_EQ(Command(GetBalls(), Traced({parent, "TRACESTATE=vendor=1"})).Wait(), 0);
  const Spans spans =
      AwaitTree(kTraceId, {"liquidblend frame", kFrameCall, "slice", "encode", "write"}, kParentId);
  const CollectedSpan root = FindSpan(spans, "liquidblend frame");
  EXPECT_EQ(root.parent_id, kParentId);
  const CollectedSpan call = FindSpan(spans, kFrameCall);
  EXPECT_EQ(call.parent_id, root.span_id);
  EXPECT_EQ(call.attributes.at("liquidblend.family"), "balls");
  EXPECT_THAT(ChildrenOf(call, spans), IsSupersetOf({"queue", "slice", "encode", "write"}));
  for (const CollectedSpan& span : spans) EXPECT_EQ(span.state, "vendor=1") << span.name;
}

// Without a collector of its own, the command still says whose call it is.
TEST_F(TraceTest, TheServersSpansAreTheCallersIfTheCommandHasNoCollector) {
  Process server = StartServer(0, Traced());
  const std::string parent = absl::StrCat("TRACEPARENT=00-", kTraceId, "-", kParentId, "-01");
  ASSERT_EQ(Command({"list"}, {parent}).Wait(), 0);
  for (const CollectedSpan& span :
       AwaitTree(kTraceId, {"liquidblend.v1.LiquidBlend/ListFamilies"}, kParentId)) {
    EXPECT_EQ(span.parent_id, kParentId) << span.name;
  }
}

TEST_F(TraceTest, TheNextWorkerGoesOnInTheSameTrace) {
  Process server = StartServer(0, Traced());
  lease_ = "1s";
  {
    Process worker = StartWorker();
    ImportBoth();
  }
  Process command = Command(RegisterBallsLong(), Traced());
  Operation registration;
  Await([&] {
    grpc::ClientContext context;
    google::longrunning::ListOperationsResponse operations;
    EXPECT_TRUE(operations_->ListOperations(&context, {}, &operations).ok());
    for (const Operation& operation : operations.operations()) {
      if (!operation.done()) registration = operation;
    }
    return !registration.name().empty();
  });
  const std::unique_ptr<store::Catalog> catalog = OpenCatalog();
  Process first = StartWorker(Traced({"LIQUIDBLEND_CHECKPOINT_INTERVAL=1ms"}));
  const std::string job = registration.name().substr(std::string("operations/").size());
  Await([&] { return !catalog->GetJob(job)->checkpoint_blob().empty(); });
  first.Kill();
  Process second = StartWorker(Traced());
  ASSERT_EQ(command.Wait(), 0);
  const CollectedSpan root =
      FindSpan(collector_.AwaitNames({"liquidblend register"}), "liquidblend register");
  // The killed worker has left no span of its attempt, only some of its stages.
  const Spans spans =
      OfTrace(root.trace_id, collector_.AwaitNames({kRegisterCall, "registration attempt"}));
  const CollectedSpan call = FindSpan(spans, kRegisterCall);
  EXPECT_THAT(ChildrenOf(call, spans), UnorderedElementsAre("registration attempt"));
  const CollectedSpan attempt = FindSpan(spans, "registration attempt");
  EXPECT_EQ(attempt.attributes.at("liquidblend.job.attempt"), "2");
  EXPECT_THAT(ChildrenOf(attempt, spans), IsSupersetOf({"registration", "publishing"}));
  std::vector<std::string> events;
  for (const CollectedSpan& span : spans) {
    events.insert(events.end(), span.events.begin(), span.events.end());
  }
  EXPECT_THAT(events, UnorderedElementsAre("resumed from a checkpoint"));
}

TEST_F(TraceTest, ACollectorThatIsNotThereChangesNothing) {
  int port = 0;
  {
    const store::LoopbackListener gone;
    port = gone.port();
  }
  const std::vector<std::string> environment = {
      absl::StrCat("OTEL_EXPORTER_OTLP_ENDPOINT=http://127.0.0.1:", port),
      "OTEL_BSP_SCHEDULE_DELAY=1"};
  Process server = StartServer(1, environment);
  ImportBoth();
  EXPECT_EQ(Command(RegisterBalls(), environment).Wait(), 0);
  EXPECT_EQ(Command(GetBalls(), environment).Wait(), 0);
  EXPECT_EQ(Command({"inspect", "families/none"}, environment).Wait(), 4) << "not found, as ever";
  server.Signal(SIGTERM);
  EXPECT_EQ(server.Wait(), 0);
}

TEST_F(TraceTest, NothingIsSentUnlessAskedFor) {
  const std::string parent = absl::StrCat("TRACEPARENT=00-", kTraceId, "-", kParentId, "-01");
  const std::vector<std::string> off = Traced({"OTEL_SDK_DISABLED=true", parent});
  Process server = StartServer(1, off);
  ImportBoth();
  ASSERT_EQ(Command(RegisterBalls(), off).Wait(), 0);
  ASSERT_EQ(Command(GetBalls(), {parent}).Wait(), 0);
  server.Signal(SIGTERM);
  EXPECT_EQ(server.Wait(), 0);
  EXPECT_EQ(collector_.num_requests(), 0);
}

}  // namespace
}  // namespace liquidblend::e2e
