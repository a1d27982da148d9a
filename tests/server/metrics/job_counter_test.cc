#include "server/metrics/job_counter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "tests/core/store/store_testing.h"

namespace liquidblend::metrics {
namespace {

using testing::HasSubstr;

class JobCounterTest : public testing::Test {
 protected:
  store::CatalogOptions Options() {
    store::CatalogOptions options;
    options.now = [this] { return now_; };
    return options;
  }

  void Submit(const std::string& id) {
    store::pb::AnimationRecord animation;
    animation.set_id(id);
    store::pb::JobRecord job;
    job.mutable_import_animation()->set_animation(id);
    ASSERT_TRUE(catalog_->SubmitImport(animation, job).ok());
  }

  std::string Lease() {
    const auto lease = catalog_->LeaseJob("worker", absl::Seconds(30));
    EXPECT_TRUE(lease.ok() && lease->has_value());
    return (*lease)->lease_id;
  }

  // Publishes the animation of the next job.
  void Publish(const std::string& id) {
    store::pb::AnimationRecord animation;
    animation.set_id(id);
    ASSERT_TRUE(catalog_->PublishAnimation(Lease(), animation).ok());
  }

  std::string Update() {
    EXPECT_TRUE(counter_.Update().ok());
    return metrics_.Text({});
  }

  static std::string Line(const std::string& code, int count) {
    return absl::StrCat("liquidblend_jobs_ended_total{code=\"", code, "\",kind=\"import\"} ", count,
                        "\n");
  }

  absl::Time now_ = absl::FromUnixSeconds(1700000000);
  const store::TemporaryFolder folder_;
  const std::unique_ptr<store::Catalog> catalog_ =
      *store::OpenSqliteCatalog(folder_.path() + "/catalog.db", Options());
  Metrics metrics_;
  JobCounter counter_{*catalog_, metrics_};
};

TEST_F(JobCounterTest, CountsEachJobOnceFromTheFirstUpdateOn) {
  Submit("before");
  Publish("before");
  EXPECT_THAT(Update(), HasSubstr(Line("OK", 0)));
  Submit("a");
  now_ += absl::Seconds(3);
  const std::string lease = Lease();
  now_ += absl::Seconds(20);
  store::pb::AnimationRecord animation;
  animation.set_id("a");
  ASSERT_TRUE(catalog_->PublishAnimation(lease, animation).ok());
  for (int k = 0; k < 2; ++k) {
    const std::string text = Update();
    EXPECT_THAT(text, HasSubstr(Line("OK", 1)));
    EXPECT_THAT(text, HasSubstr("liquidblend_job_seconds_sum{kind=\"import\",phase=\"wait\"} 3\n"));
    EXPECT_THAT(text,
                HasSubstr("liquidblend_job_seconds_sum{kind=\"import\",phase=\"work\"} 20\n"));
  }
}

TEST_F(JobCounterTest, InAnEmptyCatalogTheFirstJobCounts) {
  Update();
  now_ += absl::Seconds(1);
  Submit("a");
  Publish("a");
  EXPECT_THAT(Update(), HasSubstr(Line("OK", 1)));
}

TEST_F(JobCounterTest, CountsErrorsAndFailedAttempts) {
  Update();
  Submit("a");
  Lease();
  now_ += absl::Seconds(30);  // the lease runs out
  const absl::Status torn = absl::DataLossError("torn");
  ASSERT_TRUE(catalog_->FailJob(Lease(), torn, /*retry=*/false).ok());
  const std::string text = Update();
  EXPECT_THAT(text, HasSubstr(Line("DATA_LOSS", 1)));
  EXPECT_THAT(text, HasSubstr("failed_total{kind=\"import\",reason=\"worker_lost\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("failed_total{kind=\"import\",reason=\"error\"} 1\n"));
}

TEST_F(JobCounterTest, AJobThatNeverBeganHasNoTimes) {
  Update();
  Submit("a");
  now_ += absl::Seconds(1);
  const std::string id = catalog_->ListJobs(1, "")->records[0].id();
  ASSERT_TRUE(catalog_->RequestCancel(id).ok());
  const std::string text = Update();
  EXPECT_THAT(text, HasSubstr(Line("CANCELLED", 1)));
  EXPECT_THAT(text, HasSubstr("liquidblend_job_seconds_count{kind=\"import\",phase=\"wait\"} 0\n"));
}

}  // namespace
}  // namespace liquidblend::metrics
