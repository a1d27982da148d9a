// Workers as tasks of a farm: they leave when there is nothing left to do, after so many jobs, or
// before their time is over.
#include <signal.h>

#include <string>
#include <vector>

#include "absl/time/time.h"
#include "core/base/steady_cond_var.h"
#include "core/store/catalog/catalog.h"
#include "tests/e2e/e2e_testing.h"

namespace liquidblend::e2e {
namespace {

using store::pb::JobRecord;

constexpr int kStopped = 75;

class DrainTest : public E2eTest {
 protected:
  // A worker with these flags, too; its exit status tells whether it was drained.
  Process StartTask(const std::vector<std::string>& flags) {
    std::vector<std::string> arguments = WorkerArguments();
    arguments.insert(arguments.end(), {"--stopped-status", std::to_string(kStopped)});
    arguments.insert(arguments.end(), flags.begin(), flags.end());
    return Process("liquidblend-worker", arguments, WithStore());
  }

  JobRecord JobOf(const Operation& operation) {
    return *OpenCatalog()->GetJob(operation.name().substr(std::string("operations/").size()));
  }

  // Seconds of work.
  Operation SubmitLong() {
    for (const char* const id : {"a", "b"}) ImportBall(id, id[0] == 'a' ? 1.0 : 2.0);
    EXPECT_EQ(StartTask({"--drain", "--idle-time", "0s"}).Wait(), 0);
    Operation registration;
    EXPECT_TRUE(Register(LongWork(), registration).ok());
    return registration;
  }
};

TEST_F(DrainTest, AWorkerThatIsToDrainDoesAllAndEnds) {
  Process server = StartServer();
  std::vector<Operation> imports;
  for (const char* const id : {"a", "b", "c"}) imports.push_back(ImportBall(id, 1.0));
  EXPECT_EQ(StartTask({"--drain", "--idle-time", "100ms"}).Wait(), 0);
  for (const Operation& import : imports) EXPECT_EQ(JobOf(import).state(), JobRecord::SUCCEEDED);
}

TEST_F(DrainTest, AWorkerEndsAfterSoManyJobs) {
  Process server = StartServer();
  const Operation first = ImportBall("a", 1.0);
  const Operation second = ImportBall("b", 1.0);
  EXPECT_EQ(StartTask({"--max-jobs", "1"}).Wait(), kStopped);
  EXPECT_EQ(JobOf(first).state(), JobRecord::SUCCEEDED);
  EXPECT_EQ(JobOf(second).state(), JobRecord::QUEUED);
}

TEST_F(DrainTest, AWorkerHandsItsJobBackAndEndsBeforeItsTimeIsOver) {
  Process server = StartServer();
  const Operation registration = SubmitLong();
  JobRecord left;
  // Its time may be over before it has the job.
  for (int k = 0; k < 10 && left.handed_back() == 0; ++k) {
    const auto begin = base::SteadyClock::now();
    EXPECT_EQ(StartTask({"--drain", "--max-time", "6s"}).Wait(), kStopped);
    EXPECT_LT(base::Since(begin), absl::Seconds(6));
    left = JobOf(registration);
    EXPECT_EQ(left.state(), JobRecord::QUEUED);
    EXPECT_EQ(left.attempts(), 0);
  }
  EXPECT_EQ(left.handed_back(), 1);
  EXPECT_EQ(StartTask({"--drain", "--idle-time", "0s"}).Wait(), 0);
  EXPECT_EQ(JobOf(registration).state(), JobRecord::SUCCEEDED);
}

TEST_F(DrainTest, SignalsThatFarmsSendMeanTheSame) {
  Process server = StartServer();
  const Operation registration = SubmitLong();
  int num_handed_back = 0;
  for (const int signal : {SIGTERM, SIGINT, SIGUSR1}) {
    Process worker = StartTask({"--drain"});
    Await([&] { return JobOf(registration).state() == JobRecord::RUNNING; });
    worker.Signal(signal);
    EXPECT_EQ(worker.Wait(), kStopped) << signal;
    EXPECT_EQ(JobOf(registration).handed_back(), ++num_handed_back) << signal;
  }
}

}  // namespace
}  // namespace liquidblend::e2e
