#include "server/rpc/upload_tally.h"

#include <gtest/gtest.h>

namespace liquidblend::rpc {
namespace {

TEST(UploadTally, SumsByOwner) {
  UploadTally tally;
  EXPECT_EQ(tally.Add("ann", 5), 5);
  EXPECT_EQ(tally.Add("ann", 6), 11);
  EXPECT_EQ(tally.Add("ben", 1), 1);
  EXPECT_EQ(tally.Add("ann", -5), 6);
  EXPECT_EQ(tally.Add("ann", -6), 0);
  EXPECT_EQ(tally.Add("ben", 0), 1);
}

TEST(UploadTally, PromisesCountUntilTheyEndOrAreOver) {
  UploadTally tally;
  EXPECT_EQ(tally.Promise("ann", "one", 5, absl::Hours(1)), 5);
  EXPECT_EQ(tally.Promise("ann", "two", 7, absl::Hours(1)), 12);
  tally.EndPromise("ann", "one");
  tally.EndPromise("ann", "one");
  tally.EndPromise("ben", "two");
  EXPECT_EQ(tally.Add("ann", 0), 7);
  EXPECT_EQ(tally.Promise("ann", "over", 100, absl::ZeroDuration()), 7);
  EXPECT_EQ(tally.Add("ann", 1), 8);
}

}  // namespace
}  // namespace liquidblend::rpc
