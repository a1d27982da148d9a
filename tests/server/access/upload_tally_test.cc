#include "server/access/upload_tally.h"

#include <gtest/gtest.h>

#include <string>

namespace liquidblend::server {
namespace {

TEST(UploadTally, SumsByOwner) {
  UploadTally tally;
  EXPECT_EQ(tally.Add("ann", 5), 5);
  EXPECT_EQ(tally.Add("ann", 6), 11);
  EXPECT_EQ(tally.Add("ben", 1), 1);
  EXPECT_EQ(tally.Sum(), 12);
  EXPECT_EQ(tally.Add("ann", -5), 6);
  EXPECT_EQ(tally.Add("ann", -6), 0);
  EXPECT_EQ(tally.Add("ben", 0), 1);
}

TEST(UploadTally, PromisesCountUntilTheyEndOrAreOver) {
  UploadTally tally;
  EXPECT_TRUE(tally.Promise("ann", "one", 5, absl::Hours(1)));
  EXPECT_TRUE(tally.Promise("ann", "two", 7, absl::Hours(1)));
  EXPECT_EQ(tally.Add("ann", 0), 12);
  EXPECT_TRUE(tally.HasPromise("ann", "one"));
  EXPECT_FALSE(tally.HasPromise("ben", "one"));
  tally.EndPromise("ann", "one");
  tally.EndPromise("ann", "one");
  tally.EndPromise("ben", "two");
  EXPECT_FALSE(tally.HasPromise("ann", "one"));
  EXPECT_EQ(tally.Add("ann", 1), 8);
  EXPECT_TRUE(tally.Promise("cid", "over", 100, absl::ZeroDuration()));
  EXPECT_EQ(tally.Add("cid", 0), 0);
}

TEST(UploadTally, PromisesAreBounded) {
  UploadTally tally;
  for (size_t k = 0; k < UploadTally::kMaxPromises; ++k) {
    ASSERT_TRUE(tally.Promise("ann", std::to_string(k), 1, absl::Hours(1)));
  }
  EXPECT_FALSE(tally.Promise("ann", "one more", 1, absl::Hours(1)));
  EXPECT_EQ(tally.Add("ann", 0), static_cast<int64_t>(UploadTally::kMaxPromises));
  EXPECT_TRUE(tally.Promise("ben", "one", 1, absl::Hours(1)));
}

}  // namespace
}  // namespace liquidblend::server
