#include "server/metrics/owner_figures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "absl/strings/str_cat.h"

namespace liquidblend::metrics {
namespace {

store::OwnerUse UseOf(const std::string& owner, int64_t stored_bytes, int64_t num_queued_jobs) {
  store::OwnerUse use;
  use.owner = owner;
  use.stored_bytes = stored_bytes;
  use.num_queued_jobs = num_queued_jobs;
  return use;
}

TEST(JoinOwners, UseAndLimitsAreOfTheSameOwner) {
  const std::vector<OwnerFigures> owners =
      JoinOwners({UseOf("", 5, 0), UseOf("farm", 10, 1), UseOf("studio", 20, 2)},
                 {{"farm", {.max_stored_bytes = 100, .max_queued_jobs = 0}},
                  {"idle", {.max_stored_bytes = 0, .max_queued_jobs = 3}},
                  {"studio", {}}});
  ASSERT_EQ(owners.size(), 4);
  EXPECT_EQ(owners[0].owner, "farm");
  EXPECT_EQ(owners[0].stored_bytes, 10);
  EXPECT_EQ(owners[0].queued_jobs, 1);
  EXPECT_EQ(owners[0].limits.max_stored_bytes, 100);
  EXPECT_EQ(owners[1].owner, "idle");
  EXPECT_EQ(owners[1].stored_bytes, 0);
  EXPECT_EQ(owners[1].limits.max_queued_jobs, 3);
  EXPECT_EQ(owners[2].owner, "studio");
  EXPECT_EQ(owners[2].queued_jobs, 2);
  EXPECT_EQ(owners[3].owner, "(nobody)");
}

TEST(JoinOwners, ThoseBeyondTheMostAreAddedUp) {
  std::vector<store::OwnerUse> uses;
  for (int k = 0; k < 100; ++k) uses.push_back(UseOf(absl::StrCat("owner ", k), 1000 - k, 1));
  uses.push_back(UseOf("limited", 0, 0));
  const std::vector<OwnerFigures> owners =
      JoinOwners(uses, {{"limited", {.max_stored_bytes = 1, .max_queued_jobs = 1}}});
  ASSERT_EQ(owners.size(), kMaxOwners + 1);
  EXPECT_EQ(owners[0].owner, "limited");
  EXPECT_EQ(owners[1].owner, "owner 0");
  EXPECT_EQ(owners[kMaxOwners - 1].owner, "owner 62");
  EXPECT_EQ(owners.back().owner, "(others)");
  EXPECT_EQ(owners.back().queued_jobs, 37);
  int64_t stored_bytes = 0;
  for (const OwnerFigures& owner : owners) stored_bytes += owner.stored_bytes;
  EXPECT_EQ(stored_bytes, 100 * 1000 - 99 * 100 / 2);
}

}  // namespace
}  // namespace liquidblend::metrics
