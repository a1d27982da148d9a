#include "server/api/operation_watch.h"

#include <atomic>

#include "absl/synchronization/notification.h"
#include "absl/time/clock.h"
#include "tests/server/backends_testing.h"

namespace liquidblend::server {
namespace {

using store::Fails;

class OperationWatchTest : public RpcTest {
 protected:
  OperationWatchTest() : backends_(*catalog_, *blobs_, families_, SmallBackends()) {}
  ~OperationWatchTest() override { backends_.Stop(); }

  std::shared_ptr<OperationWatch> Watch(const std::string& id) {
    return std::make_shared<OperationWatch>(backends_, "operations/" + id,
                                            [this] { return is_wanted_.load(); });
  }

  // What `ask` gives.
  static absl::StatusOr<SeenOperationPtr> Await(
      const std::function<void(OperationWatch::Done)>& ask) {
    absl::StatusOr<SeenOperationPtr> result;
    absl::Notification is_given;
    ask([&](absl::StatusOr<SeenOperationPtr> seen) {
      result = std::move(seen);
      is_given.Notify();
    });
    is_given.WaitForNotification();
    return result;
  }
  static absl::StatusOr<SeenOperationPtr> Next(OperationWatch& watch) {
    return Await([&](OperationWatch::Done done) { watch.Next(std::move(done)); });
  }

  std::atomic<bool> is_wanted_ = true;
  Backends backends_;
};

TEST_F(OperationWatchTest, GivesEachChangeOnceAsItIsAskedFor) {
  const store::pb::JobRecord job = SubmitImport("drop");
  const auto watch = Watch(job.id());
  const auto queued = Next(*watch);
  ASSERT_TRUE(queued.ok()) << queued.status();
  EXPECT_FALSE((*queued)->operation.done());
  const store::Lease lease = TakeJob();
  const auto running = Next(*watch);
  ASSERT_TRUE(running.ok());
  EXPECT_NE((*running)->bytes, (*queued)->bytes);
  ASSERT_TRUE(catalog_->FailJob(lease.lease_id, absl::DataLossError("torn"), false).ok());
  EXPECT_TRUE((*Next(*watch))->operation.done());
}

TEST_F(OperationWatchTest, AwaitsTheEndOrTheDeadline) {
  const store::pb::JobRecord job = SubmitImport("drop");
  const auto early = Await([&](OperationWatch::Done done) {
    Watch(job.id())->AwaitDone(absl::Now() + absl::Milliseconds(20), std::move(done));
  });
  EXPECT_FALSE((*early)->operation.done());
  ASSERT_TRUE(catalog_->RequestCancel(job.id()).ok());
  const auto late = Await([&](OperationWatch::Done done) {
    Watch(job.id())->AwaitDone(absl::InfiniteFuture(), std::move(done));
  });
  EXPECT_TRUE((*late)->operation.done());
}

TEST_F(OperationWatchTest, EndsSoonAfterNobodyWantsItAnyMore) {
  const store::pb::JobRecord job = SubmitImport("drop");
  const auto watch = Watch(job.id());
  ASSERT_TRUE(Next(*watch).ok());
  is_wanted_ = false;
  EXPECT_THAT(Next(*watch).status(), Fails(absl::StatusCode::kCancelled, "gone"));
}

TEST_F(OperationWatchTest, TellsWhatIsNotThereAndThatTheServerStops) {
  EXPECT_TRUE(absl::IsNotFound(Next(*Watch("none")).status()));
  backends_.Stop();
  EXPECT_TRUE(absl::IsUnavailable(Next(*Watch("none")).status()));
}

TEST_F(OperationWatchTest, AStopEndsAWatchThatWaitsForItsNextLook) {
  const store::pb::JobRecord job = SubmitImport("drop");
  BackendsOptions options = SmallBackends();
  options.limits.watch_interval = absl::Hours(1);
  Backends backends(*catalog_, *blobs_, families_, options);
  auto watch =
      std::make_shared<OperationWatch>(backends, "operations/" + job.id(), [] { return true; });
  ASSERT_TRUE(Next(*watch).ok());
  const std::weak_ptr<OperationWatch> is_alive = watch;
  absl::Status status;
  watch->Next([&status, owner = watch](const absl::StatusOr<SeenOperationPtr>& seen) {
    status = seen.status();
  });
  watch.reset();
  EXPECT_FALSE(is_alive.expired());
  backends.Stop();
  EXPECT_TRUE(absl::IsUnavailable(status)) << status;
  EXPECT_TRUE(is_alive.expired()) << "what is called owns the watch";
}

}  // namespace
}  // namespace liquidblend::server
