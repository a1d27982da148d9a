// The fault table's clocks: they are set, forth and back, while programs wait and work.
#include <signal.h>

#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "tests/e2e/faults/faults_testing.h"

namespace liquidblend::e2e {
namespace {

constexpr int64_t kHourUs = 3'600'000'000;

enum class Whose { kAll, kWorker, kServer };

struct Jump {
  Whose whose;
  Tier tier;
  int hours;
};

std::string DescriptionOf(const Jump& jump) {
  const char* const whose[] = {"the machine's", "the worker's", "the server's"};
  return absl::StrCat(whose[static_cast<int>(jump.whose)], " clock jumps by ",
                      jump.hours > 0 ? "+" : "", jump.hours, " h");
}

std::string NameOf(const testing::TestParamInfo<Jump>& jump) {
  const char* const whose[] = {"all_", "worker_", "server_"};
  return absl::StrCat(whose[static_cast<int>(jump.param.whose)],
                      jump.param.tier == Tier::kShared ? "shared_" : "embedded_",
                      jump.param.hours > 0 ? "forth" : "back");
}

class FaultsClockTest : public FaultTest, public testing::WithParamInterface<Jump> {
 protected:
  //   max_retried  attempts in all runs that may be lost
  void Each(const std::string& fault, int max_retried,
            const std::function<void(FaultLayer&)>& run_once) {
    FaultLine line(absl::StrCat(DescriptionOf(GetParam()), fault), GetParam().tier);
    const auto run_all = [&] {
      for (int run = 1; run <= NumFaultRuns(); ++run) {
        BeginRun(line, GetParam().tier);
        run_once(MakeLayer(/*has_disk=*/false));
      }
    };
    run_all();
    // A worker that a busy machine stops for its whole lease loses an attempt, too, but hardly
    // twice in so few runs; what the clock does comes again.
    if (max_retried == 0 && line.num_retried > 0) {
      line.Restart();
      run_all();
    }
    EXPECT_LE(line.num_retried, max_retried);
  }

  std::vector<std::string> Layered(FaultLayer& layer, Whose whose) {
    if (GetParam().whose != whose && GetParam().whose != Whose::kAll) return {};
    return layer.environment();
  }

  void SetClock(FaultLayer& layer) { layer.control().clock_ahead_us = GetParam().hours * kHourUs; }

  const std::vector<std::string> kRightClock = {};
};

// The job takes longer than its lease, and a second worker waits for that to end.
TEST_P(FaultsClockTest, InMidJob) {
  TakeTime();
  // Leases in SQLite look as if they had run out, or were of no length that there is, until they
  // are renewed; PostgreSQL has a clock of its own.
  const bool may_retry = GetParam().tier == Tier::kEmbedded;
  Each(" in mid-job", may_retry ? 2 * NumFaultRuns() : NumFaultRuns() / 10, [&](FaultLayer& layer) {
    Process server = StartServer(0, Layered(layer, Whose::kServer));
    Process worker = StartFaultWorker(Layered(layer, Whose::kWorker));
    EXPECT_TRUE(SubmitWork());
    AwaitMidJob();
    const bool is_shared = GetParam().tier == Tier::kShared;
    Process second = StartFaultWorker(is_shared ? kRightClock : layer.environment());
    SetClock(layer);
    EndRun(std::move(server), std::move(worker));
  });
}

// Whoever waits for the lease of a lost worker does not wait for an hour.
TEST_P(FaultsClockTest, AfterAWorkerWasLost) {
  TakeTime();  // a short job may be done before its first checkpoint is recorded
  constexpr int kAnyNumber = std::numeric_limits<int>::max();
  Each(" after a worker was lost", kAnyNumber, [&](FaultLayer& layer) {
    Process server = StartServer(0, Layered(layer, Whose::kServer));
    EXPECT_TRUE(SubmitWork());
    Process lost = StartFaultWorker({"LIQUIDBLEND_FAULT_POINT=checkpoint.after_commit"});
    EXPECT_TRUE(AwaitDeath(lost)) << "the job was done before its first checkpoint";
    EXPECT_EQ(lost.Kill(), -SIGKILL);
    Process worker = StartFaultWorker(Layered(layer, Whose::kWorker));
    SetClock(layer);
    EndRun(std::move(server), std::move(worker));
  });
}

INSTANTIATE_TEST_SUITE_P(Jumps, FaultsClockTest,
                         testing::Values(Jump{Whose::kAll, Tier::kEmbedded, 1},
                                         Jump{Whose::kAll, Tier::kEmbedded, -1},
                                         Jump{Whose::kWorker, Tier::kShared, 1},
                                         Jump{Whose::kWorker, Tier::kShared, -1},
                                         Jump{Whose::kServer, Tier::kShared, 1},
                                         Jump{Whose::kServer, Tier::kShared, -1}),
                         NameOf);

}  // namespace
}  // namespace liquidblend::e2e
