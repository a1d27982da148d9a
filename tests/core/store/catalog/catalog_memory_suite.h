// CatalogSuite: what workers can hold. Included by catalog_suite.h.
#pragma once

#include <string>

#include "tests/core/store/catalog/catalog_testing.h"

namespace liquidblend::store {

TEST_P(CatalogSuite, LeavesWhatAWorkerCannotHoldToOthers) {
  const Job large = MustSubmitOfMemory("large", 1000);
  const Job small = MustSubmitOfMemory("small", 999);
  const auto take = [&](int64_t memory_bytes) -> std::string {
    const auto lease = catalog_->LeaseJob("worker", kLease, memory_bytes);
    EXPECT_THAT(lease, Succeeds());
    return lease.ok() && lease->has_value() ? (*lease)->job.id() : "";
  };
  EXPECT_EQ(take(998), "");
  EXPECT_EQ(take(999), small.id());
  EXPECT_EQ(take(999), "");
  EXPECT_EQ(GetJob(large.id()).state(), Job::QUEUED);
  EXPECT_EQ(GetJob(large.id()).memory_bytes(), 1000);
  EXPECT_EQ(take(1000), large.id());
}

TEST_P(CatalogSuite, ALostJobIsLeftToWhoCanHoldIt) {
  const Job large = MustSubmitOfMemory("large", 1000);
  MustLease();
  now_ += kLease;
  EXPECT_FALSE((*catalog_->LeaseJob("small", kLease, 999)).has_value());
  EXPECT_EQ(GetJob(large.id()).state(), Job::RUNNING);
  EXPECT_EQ(MustLease().job.id(), large.id());
}

TEST_P(CatalogSuite, AWorkerDoesNotWakeForWhatItCannotHold) {
  MustSubmitOfMemory("large", 1000);
  // The first time PostgreSQL may have told of the job; then nobody does.
  ASSERT_THAT(catalog_->WaitForJob(absl::Milliseconds(1), 999), Succeeds());
  const auto idle = catalog_->WaitForJob(absl::Milliseconds(1), 999);
  ASSERT_THAT(idle, Succeeds());
  EXPECT_FALSE(*idle);
  const auto other = backend_->Open(Options());
  const auto woken = other->WaitForJob(absl::Seconds(10), 1000);
  ASSERT_THAT(woken, Succeeds());
  EXPECT_TRUE(*woken);
}

TEST_P(CatalogSuite, ChildrenNeedAsMuchAsTheirRegistration) {
  for (const std::string id : {"a", "b"}) MakeAnimation(id);
  Job job = RegistrationOf("f", "a", {"a", "b"});
  job.set_memory_bytes(1000);
  ASSERT_THAT(catalog_->SubmitRegistration(job), Succeeds());
  EXPECT_FALSE((*catalog_->LeaseJob("worker", kLease, 999)).has_value());
  EXPECT_EQ(MustLease().job.memory_bytes(), 1000);
}

TEST_P(CatalogSuite, CountsJobsByMemory) {
  constexpr int64_t kGibibyte = int64_t{1} << 30;
  EXPECT_THAT(*catalog_->CountJobsByMemory(), ::testing::IsEmpty());
  for (const std::string id : {"a", "b"}) MakeAnimation(id);
  MustSubmitOfMemory("unknown", 0);
  MustLease();
  MustSubmitOfMemory("one", kGibibyte);
  MustSubmitOfMemory("two", kGibibyte + 1);
  MustSubmitOfMemory("all", kAnyMemory);
  Job registration = RegistrationOf("f", "a", {"a", "b"});
  registration.set_memory_bytes(5 * kGibibyte);
  ASSERT_THAT(catalog_->SubmitRegistration(registration), Succeeds());
  // The registration waits for its children and is not counted.
  const JobMemoryCounts expected = {{{Job::RUNNING, 1}, 1},
                                    {{Job::QUEUED, 1}, 1},
                                    {{Job::QUEUED, 2}, 1},
                                    {{Job::QUEUED, 5}, 2},
                                    {{Job::QUEUED, kAnyMemory / kGibibyte + 1}, 1}};
  EXPECT_EQ(*catalog_->CountJobsByMemory(), expected);
}

TEST_P(CatalogSuite, KnowsTheWorkersThatAskedLately) {
  EXPECT_TRUE(catalog_->ListWorkers()->empty());
  EXPECT_FALSE((*catalog_->LeaseJob("b", kLease, 7)).has_value());
  now_ += absl::Minutes(1);
  EXPECT_FALSE((*catalog_->LeaseJob("a", kLease)).has_value());
  const auto both = catalog_->ListWorkers();
  ASSERT_THAT(both, Succeeds());
  ASSERT_EQ(both->size(), 2);
  EXPECT_EQ((*both)[0].name(), "a");
  EXPECT_EQ((*both)[0].memory_bytes(), kAnyMemory);
  EXPECT_EQ((*both)[1].name(), "b");
  EXPECT_EQ((*both)[1].memory_bytes(), 7);
  EXPECT_EQ((*both)[1].seen_time().seconds(), 1700000000);
  now_ += absl::Minutes(1) + absl::Seconds(1);
  ASSERT_EQ(catalog_->ListWorkers()->size(), 1);
  EXPECT_EQ(catalog_->ListWorkers()->at(0).name(), "a");
  EXPECT_FALSE((*catalog_->LeaseJob("a", kLease, 8)).has_value());  // started again with less
  EXPECT_EQ(catalog_->ListWorkers()->at(0).memory_bytes(), 8);
}

TEST_P(CatalogSuite, KnowsWhyAWorkerTakesNoJobs) {
  pb::WorkerRecord worker;
  worker.set_name("a");
  worker.set_memory_bytes(7);
  worker.set_refusal("S3 refuses");
  ASSERT_THAT(catalog_->RecordWorker(worker), Succeeds());
  ASSERT_EQ(catalog_->ListWorkers()->size(), 1);
  EXPECT_EQ(catalog_->ListWorkers()->at(0).refusal(), "S3 refuses");
  EXPECT_EQ(catalog_->ListWorkers()->at(0).memory_bytes(), 7);
  EXPECT_EQ(catalog_->ListWorkers()->at(0).seen_time().seconds(), 1700000000);
  worker.set_refusal("the disk is read-only");
  ASSERT_THAT(catalog_->RecordWorker(worker), Succeeds());
  EXPECT_EQ(catalog_->ListWorkers()->at(0).refusal(), "the disk is read-only");
  EXPECT_FALSE((*catalog_->LeaseJob("a", kLease, 7)).has_value());
  EXPECT_EQ(catalog_->ListWorkers()->at(0).refusal(), "");
}

}  // namespace liquidblend::store
