#include "server/collector.h"

#include "tests/server/admin/admin_testing.h"

namespace liquidblend::server {
namespace {

using store::Succeeds;

// A store whose blobs are marked as the catalog's.
class CollectorTest : public admin::AdminTest {
 protected:
  CollectorTest() { EXPECT_THAT(data_.blobs().WriteCatalogId(*data_.catalog().Id()), Succeeds()); }

  metrics::Metrics metrics_;
};

TEST_F(CollectorTest, CollectsSoonAndThenEverySoOften) {
  const store::BlobId needed = data_.SubmitImport("a");
  for (int round = 0; round < 3; ++round) data_.Put(absl::StrCat("left over ", round));
  const Collector collector(data_.catalog(), data_.blobs(), metrics_,
                            {.every = absl::Milliseconds(5), .older_than = absl::ZeroDuration()});
  const absl::Time deadline = absl::Now() + absl::Seconds(60);
  for (int round = 0; round < 2; ++round) {
    data_.Put(absl::StrCat("left over later ", round));
    while (data_.Present() != std::vector<store::BlobId>{needed}) {
      ASSERT_LT(absl::Now(), deadline);
    }
  }
}

TEST_F(CollectorTest, CountsWhatItDeletes) {
  const store::BlobId blob = data_.Put("left over");
  const Collector collector(data_.catalog(), data_.blobs(), metrics_,
                            {.every = absl::Milliseconds(5), .older_than = absl::ZeroDuration()});
  const absl::Time deadline = absl::Now() + absl::Seconds(60);
  while (!absl::StrContains(metrics_.Text({}), "liquidblend_collected_blobs_total 1\n")) {
    ASSERT_LT(absl::Now(), deadline);
  }
  const std::string text = metrics_.Text({});
  EXPECT_THAT(text, testing::HasSubstr("liquidblend_collected_bytes_total 9\n"));
  EXPECT_THAT(text, testing::HasSubstr("liquidblend_collections_total{result=\"failed\"} 0\n"));
}

TEST_F(CollectorTest, CountsCollectionsThatFail) {
  const Collector collector(data_.catalog(), data_.blobs(), metrics_,
                            {.every = absl::Milliseconds(5), .older_than = -absl::Seconds(1)});
  const absl::Time deadline = absl::Now() + absl::Seconds(60);
  while (absl::StrContains(metrics_.Text({}),
                           "liquidblend_collections_total{result=\"failed\"} 0\n")) {
    ASSERT_LT(absl::Now(), deadline);
  }
}

TEST_F(CollectorTest, ForgetsJobsThatEndedLongAgo) {
  data_.MakeAnimation("a");
  const Collector collector(data_.catalog(), data_.blobs(), metrics_,
                            {.every = absl::Milliseconds(5), .keep_history = absl::Nanoseconds(1)});
  const absl::Time deadline = absl::Now() + absl::Seconds(60);
  while (!data_.catalog().ListJobs(0, "")->records.empty()) ASSERT_LT(absl::Now(), deadline);
  EXPECT_THAT(data_.catalog().GetAnimation("a"), store::Succeeds());
}

TEST_F(CollectorTest, EndsAtOnce) {
  const absl::Time start = absl::Now();
  Collector(data_.catalog(), data_.blobs(), metrics_, {});
  EXPECT_LT(absl::Now() - start, absl::Seconds(30));
}

TEST_F(CollectorTest, NeverCollectsIfToldSo) {
  data_.Put("left over");
  Collector(data_.catalog(), data_.blobs(), metrics_,
            {.every = absl::ZeroDuration(), .older_than = absl::ZeroDuration()});
  EXPECT_EQ(data_.Present().size(), 1);
}

}  // namespace
}  // namespace liquidblend::server
