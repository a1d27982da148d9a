#include "server/base/operation_looks.h"

#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "server/api/handlers.h"
#include "server/api/served_operation.h"
#include "tests/server/grpc/counting_catalog.h"
#include "tests/server/grpc/server_testing.h"

namespace liquidblend::server::operation_looks_test {
namespace {

class OperationLooksTest : public ServerTest {
 protected:
  OperationLooksTest() {
    BackendsOptions options = SmallBackends();
    options.limits.watch_interval = absl::Hours(1);
    backends_ = std::make_unique<Backends>(counting_, *blobs_, families_, options);
  }
  ~OperationLooksTest() override { server_.reset(); }

  store::Catalog& served_catalog() override { return counting_; }

  SeenOperationPtr Ask(const std::shared_ptr<OperationLook>& look) {
    SeenOperationPtr answer;
    absl::Notification is_answered;
    look->Ask([&](const absl::StatusOr<SeenOperationPtr>& seen) {
      EXPECT_TRUE(seen.ok()) << seen.status();
      if (seen.ok()) answer = *seen;
      is_answered.Notify();
    });
    is_answered.WaitForNotification();
    return answer;
  }

  CountingCatalog counting_{*catalog_};
  std::unique_ptr<Backends> backends_;
};

TEST_F(OperationLooksTest, AllWhoAskWithinAnIntervalShareALook) {
  const std::string name = "operations/" + SubmitImport("drop").id();
  const auto look = WatchedOperation(*backends_, name);
  EXPECT_EQ(WatchedOperation(*backends_, name), look);
  const SeenOperationPtr first = Ask(look);
  EXPECT_EQ(first->operation.name(), name);
  EXPECT_EQ(Ask(look), first);
  EXPECT_EQ(counting_.num_jobs_read(), 1);
}

TEST_F(OperationLooksTest, ThoseThatNobodyHoldsAreForgotten) {
  auto look = WatchedOperation(*backends_, "operations/a");
  const auto other = WatchedOperation(*backends_, "operations/b");
  EXPECT_NE(look, other);
  EXPECT_EQ(backends_->operation_looks.num_looks(), 2);
  look.reset();
  EXPECT_EQ(backends_->operation_looks.num_looks(), 1);
}

TEST_F(OperationLooksTest, ManyOperationsAreLookedAtLessOften) {
  const absl::Duration interval = backends_->limits.watch_interval;
  std::vector<std::shared_ptr<OperationLook>> looks;
  EXPECT_EQ(backends_->operation_looks.Interval(), interval);
  for (int k = 0; k < 2 * OperationLooks::kMaxPerInterval + 1; ++k) {
    looks.push_back(WatchedOperation(*backends_, absl::StrCat("operations/", k)));
  }
  EXPECT_EQ(backends_->operation_looks.Interval(), 3 * interval);
  looks.clear();
  EXPECT_EQ(backends_->operation_looks.Interval(), interval);
}

// Watches that see no change look again every interval.
TEST_F(OperationLooksTest, ManyWatchesReadAJobAsOftenAsOneDoes) {
  constexpr int kNumWatches = 100;
  constexpr int kNumIntervals = 20;
  const store::pb::JobRecord job = SubmitImport("drop");
  v1::WatchOperationRequest request;
  request.set_name("operations/" + job.id());
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::unique_ptr<grpc::ClientReader<Operation>>> watches;
  for (int k = 0; k < kNumWatches; ++k) {
    contexts.push_back(std::make_unique<grpc::ClientContext>());
    watches.push_back(stub_->WatchOperation(contexts.back().get(), request));
    Operation operation;
    ASSERT_TRUE(watches.back()->Read(&operation));
  }
  const absl::Time begin = absl::Now();
  const int before = counting_.num_jobs_read();
  while (counting_.num_jobs_read() < before + kNumIntervals) {
    ASSERT_LT(absl::Now() - begin, absl::Seconds(20));
  }
  // Each look ends before the next one can begin, an interval later.
  EXPECT_GE(absl::Now() - begin, (kNumIntervals - 2) * SmallLimits().watch_interval);
  ASSERT_TRUE(catalog_->RequestCancel(job.id()).ok());
  for (const auto& watch : watches) {
    Operation operation;
    while (!operation.done()) ASSERT_TRUE(watch->Read(&operation));
    EXPECT_THAT(watch->Finish(), IsOk());
  }
}

TEST_F(OperationLooksTest, APageOfOperationsAsksForTheWorkersOnce) {
  store::CatalogOptions long_ago;
  long_ago.now = [] { return absl::Now() - absl::Hours(1); };
  const auto before = *store::OpenSqliteCatalog(store::CatalogPath(folder_.path()), long_ago);
  for (const char* id : {"a", "b", "c"}) {
    store::pb::AnimationRecord animation;
    animation.set_id(id);
    store::pb::JobRecord job;
    job.mutable_import_animation()->set_animation(id);
    ASSERT_TRUE(before->SubmitImport(animation, job).ok());
  }
  const auto listed = ListOperations(*backends_, {});
  ASSERT_TRUE(listed.ok()) << listed.status();
  ASSERT_EQ(listed->operations_size(), 3);
  v1::ImportAnimationMetadata metadata;
  ASSERT_TRUE(listed->operations(2).metadata().UnpackTo(&metadata));
  EXPECT_EQ(metadata.progress().waiting_for(), "no worker has asked for work lately");
  EXPECT_EQ(counting_.num_lists_of_workers(), 1);
}

}  // namespace
}  // namespace liquidblend::server::operation_looks_test
