// The fault table's database: PostgreSQL killed, restarted and cut off; two servers at once.
#include <signal.h>

#include <thread>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "tests/e2e/balls_stream.h"
#include "tests/e2e/faults/fault_proxy.h"
#include "tests/e2e/faults/faults_testing.h"

namespace liquidblend::e2e {
namespace {

class FaultsNetworkTest : public FaultTest {
 protected:
  // For a program that is to see the database through the proxy.
  std::vector<std::string> Through(const FaultProxy& proxy) {
    const std::string options = catalog_url().substr(catalog_url().find("&options="));
    return {absl::StrCat("LIQUIDBLEND_STORE=postgresql://liquidblend:secret@127.0.0.1:",
                         proxy.port(), "/postgres?sslmode=disable&gssencmode=disable", options)};
  }

  // PostgreSQL dies at the worker's number-th statement with these words, before or after that
  // arrives.
  void KillPostgresAt(const std::string& words, int number, bool is_before) {
    FaultProxy proxy(postgres().socket());
    Process server = StartServer();
    EXPECT_TRUE(SubmitWork());
    const std::function<void()> kill_it = [&] { postgres().Kill(); };
    proxy.Once(words, number, is_before ? kill_it : nullptr, is_before ? nullptr : kill_it);
    Process worker = StartFaultWorker(Through(proxy));
    Await([&] { return proxy.is_struck(); });
    postgres().Start();
    EndRun(std::move(server), std::move(worker));
  }
};

TEST_F(FaultsNetworkTest, PostgresKilledInMidJob) {
  TakeTime();
  Each("`kill -9` of PostgreSQL in mid-job", [&](int) {
    Process server = StartServer();
    EXPECT_TRUE(SubmitWork());
    Process worker = StartFaultWorker();
    AwaitMidJob();
    postgres().Kill();
    postgres().Start();
    EndRun(std::move(server), std::move(worker));
  });
}

TEST_F(FaultsNetworkTest, PostgresKilledBeforeAResultIsWritten) {
  Each("`kill -9` of PostgreSQL before a family is written",
       [&](int) { KillPostgresAt("INTO families", 1, true); });
}

constexpr int kNumCommits = 5;  // of a worker, and more

TEST_F(FaultsNetworkTest, PostgresKilledBeforeACommit) {
  Each("`kill -9` of PostgreSQL before a COMMIT arrives",
       [&](int run) { KillPostgresAt("COMMIT", 1 + run % kNumCommits, true); });
}

TEST_F(FaultsNetworkTest, PostgresKilledAfterACommit) {
  Each("`kill -9` of PostgreSQL once a COMMIT arrives",
       [&](int run) { KillPostgresAt("COMMIT", 1 + run % kNumCommits, false); });
}

TEST_F(FaultsNetworkTest, PostgresRestartedInMidJob) {
  TakeTime();
  Each("restart of PostgreSQL in mid-job", [&](int) {
    Process server = StartServer();
    EXPECT_TRUE(SubmitWork());
    Process worker = StartFaultWorker();
    AwaitMidJob();
    postgres().Restart();
    EndRun(std::move(server), std::move(worker));
  });
}

// An idle worker is there as well, which might think that the other one is lost.
TEST_F(FaultsNetworkTest, PostgresAwayForLongerThanTheLease) {
  TakeTime();
  worker_lease_ = absl::Seconds(3);
  Each("PostgreSQL away for longer than the lease in mid-job", [&](int) {
    Process server = StartServer();
    EXPECT_TRUE(SubmitWork());
    Process worker = StartFaultWorker(), idle = StartFaultWorker();
    AwaitMidJob();
    postgres().Kill();
    absl::SleepFor(WorkerLease() + absl::Seconds(1));
    postgres().Start();
    EndRun(std::move(server), std::move(worker), [&] {
      const store::pb::JobRecord job = JobOf(registration());
      for (const auto& attempt : job.failed_attempts()) EXPECT_FALSE(attempt.worker_lost());
    });
  });
}

// Who has a family in memory needs no database for frames of it.
TEST_F(FaultsNetworkTest, FramesGoOnWhilePostgresIsAway) {
  Each("PostgreSQL away while frames are asked for", [&](int) {
    Process server = StartServer();
    {
      BallsStream begun(*stub_);
      begun.ExpectFrame();
      ExpectFrame(*stub_);
      EXPECT_TRUE(SubmitWork());
      postgres().Kill();
      BallsStream new_one(*stub_);
      const absl::Time end = absl::Now() + absl::Seconds(2);  // it is looked for four times
      while (absl::Now() < end && !HasFailure()) {
        ExpectFrame(*stub_);
        begun.ExpectFrame();
        new_one.ExpectFrame();
      }
      grpc::ClientContext context;
      v1::GetFamilyRequest request;
      request.set_name("families/balls");
      v1::Family family;
      EXPECT_EQ(stub_->GetFamily(&context, request, &family).error_code(),
                grpc::StatusCode::UNAVAILABLE);
    }
    postgres().Start();
    EndRun(std::move(server), StartFaultWorker());
  });
}

// Two workers, one lease. The first is cut off in mid-job, or when it is about to publish: then its
// statements arrive when the second has published, and must not count.
TEST_F(FaultsNetworkTest, PartitionLongerThanTheLease) {
  TakeTime();
  Each("a worker cut off from the database for longer than its lease", [&](int run) {
    FaultProxy proxy(postgres().socket());
    const bool is_at_publishing = run % 2 != 0;
    if (is_at_publishing) {  // the first time is the publication of an animation
      proxy.Once(
          "FROM catalog_version FOR SHARE", 2, [&] { proxy.Cut(); }, nullptr);
    }
    Process server = StartServer();
    EXPECT_TRUE(SubmitWork());
    Process first = StartFaultWorker(Through(proxy));
    if (!is_at_publishing) {
      AwaitMidJob();
      proxy.Cut();
    }
    Await([&] { return proxy.is_cut(); });
    EndRun(std::move(server), StartFaultWorker(), [&] {
      proxy.Heal();
      first.Signal(SIGTERM);
      EXPECT_EQ(first.Wait(), 0);
    });
  });
}

// One is refused while the other's is not done, and asks again.
TEST_F(FaultsNetworkTest, TwoServersRegisterOneFamilyAtOnce) {
  Each("two servers register and publish one family at once", [&](int) {
    Process one = StartServer();
    const auto stub_of_one = v1::LiquidBlend::NewStub(
        grpc::CreateChannel(Address(), grpc::InsecureChannelCredentials()));
    Process other = StartServer();
    Process worker = StartFaultWorker(), second = StartFaultWorker();
    std::jthread beside([&] { RegisterUntilAccepted(*stub_of_one, "registration at one"); });
    RegisterUntilAccepted(*stub_, "registration at the other");
    beside.join();
    EndRun(std::move(other), std::move(worker));
  });
}

}  // namespace
}  // namespace liquidblend::e2e
