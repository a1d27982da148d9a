#include "server/metrics/catalog_figures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>

#include "core/store/catalog/catalog.h"
#include "tests/core/store/store_testing.h"

namespace liquidblend::metrics {
namespace {

constexpr int64_t kGibibyte = int64_t{1} << 30;

class CatalogFiguresTest : public testing::Test {
 protected:
  void Submit(const std::string& id, int64_t memory_bytes) {
    store::pb::AnimationRecord animation;
    animation.set_id(id);
    store::pb::JobRecord job;
    job.mutable_import_animation()->set_animation(id);
    job.set_memory_bytes(memory_bytes);
    ASSERT_TRUE(catalog_->SubmitImport(animation, job).ok());
  }

  CatalogFigures Read() {
    const auto figures = ReadCatalogFigures(*catalog_);
    EXPECT_TRUE(figures.ok()) << figures.status();
    return figures.value_or(CatalogFigures());
  }

  const store::TemporaryFolder folder_;
  const std::unique_ptr<store::Catalog> catalog_ =
      *store::OpenSqliteCatalog(folder_.path() + "/catalog.db");
};

TEST_F(CatalogFiguresTest, AnEmptyCatalogHasZeros) {
  const CatalogFigures figures = Read();
  EXPECT_EQ(figures.jobs.at("queued"), 0);
  EXPECT_EQ(figures.workers.at("ready"), 0);
  ASSERT_EQ(figures.jobs_within_memory.size(), 2);
  for (const auto& [state, within] : figures.jobs_within_memory) {
    ASSERT_EQ(within.size(), 12) << state;  // 2^0 to 2^10 GiB, and any
    for (const auto& [memory, count] : within) EXPECT_EQ(count, 0) << state << " " << memory;
  }
}

TEST_F(CatalogFiguresTest, JobsCountForEachWorkerThatMayTakeThem) {
  Submit("running", 3 * kGibibyte);
  ASSERT_TRUE(catalog_->LeaseJob("worker", absl::Minutes(1), 4 * kGibibyte)->has_value());
  Submit("exactly", 4 * kGibibyte);
  Submit("above", 4 * kGibibyte + 1);
  Submit("largest", 2000 * kGibibyte);
  const CatalogFigures figures = Read();
  const std::map<std::string, int64_t>& queued = figures.jobs_within_memory.at("queued");
  EXPECT_EQ(queued.at("2GiB"), 0);
  EXPECT_EQ(queued.at("4GiB"), 1);
  EXPECT_EQ(queued.at("8GiB"), 2);
  EXPECT_EQ(queued.at("1024GiB"), 2);
  EXPECT_EQ(queued.at("any"), 3);
  const std::map<std::string, int64_t>& running = figures.jobs_within_memory.at("running");
  EXPECT_EQ(running.at("2GiB"), 0);
  EXPECT_EQ(running.at("4GiB"), 1);
  EXPECT_EQ(running.at("any"), 1);
  EXPECT_EQ(figures.jobs.at("queued"), 3);
  EXPECT_EQ(figures.workers.at("ready"), 1);
}

TEST_F(CatalogFiguresTest, JobsAreTooLargeThatNoWorkerCanHold) {
  Submit("large", 4 * kGibibyte);
  EXPECT_EQ(Read().queue.num_too_large, 0);  // no worker is known
  EXPECT_FALSE(catalog_->LeaseJob("small", absl::Minutes(1), kGibibyte)->has_value());
  EXPECT_EQ(Read().queue.num_too_large, 1);
  store::pb::WorkerRecord refused;
  refused.set_name("refused");
  refused.set_memory_bytes(4 * kGibibyte);
  refused.set_refusal("HTTP status 403");
  ASSERT_TRUE(catalog_->RecordWorker(refused).ok());
  EXPECT_EQ(Read().queue.num_too_large, 0);
}

}  // namespace
}  // namespace liquidblend::metrics
