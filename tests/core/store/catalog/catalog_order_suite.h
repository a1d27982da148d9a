// CatalogSuite: whose job is next. Included by catalog_suite.h.
#pragma once

#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "tests/core/store/catalog/catalog_testing.h"

namespace liquidblend::store {

TEST_P(CatalogSuite, GivesOutTheHighestPriorityFirst) {
  MustSubmitAs("a", "zero");
  MustSubmitAs("a", "low", -100);
  MustSubmitAs("b", "high", 100);
  MustSubmitAs("a", "higher than zero", 1);
  MustSubmitAs("a", "high, too", 100);
  EXPECT_THAT(Next(5),
              ::testing::ElementsAre("high", "high, too", "higher than zero", "zero", "low"));
  EXPECT_EQ(catalog_->ListJobs(0, "")->records.back().owner(), "a");
  EXPECT_EQ(catalog_->ListJobs(0, "")->records.front().priority(), 100);
}

TEST_P(CatalogSuite, OneJobDoesNotWaitForAThousandOfSomeoneElse) {
  MustSubmitMany("a", 100);
  Next(40);
  MustSubmitAs("b", "single");
  EXPECT_THAT(Next(3), ::testing::ElementsAre("a41", "single", "a42"));
}

// Nobody saves up turns for later.
TEST_P(CatalogSuite, OwnersTakeTurnsWhoeverCameFirst) {
  MustSubmitMany("a", 10);
  Next(6);
  MustSubmitMany("b", 3);
  MustSubmitMany("c", 1);
  EXPECT_THAT(Next(8), ::testing::ElementsAre("a7", "b1", "c1", "a8", "b2", "a9", "b3", "a10"));
}

TEST_P(CatalogSuite, PrioritiesHaveTurnsOfTheirOwn) {
  MustSubmitMany("a", 10);
  Next(6);
  MustSubmitAs("a", "urgent a1", 5);
  MustSubmitAs("a", "urgent a2", 5);
  MustSubmitAs("b", "urgent b", 5);
  EXPECT_THAT(Next(4), ::testing::ElementsAre("urgent a1", "urgent b", "urgent a2", "a7"));
}

TEST_P(CatalogSuite, WhatWasCancelledBeforeItBeganTakesNoTurn) {
  for (int k = 0; k < 5; ++k) {
    EXPECT_THAT(catalog_->RequestCancel(MustSubmitAs("a", "wrong").id()), Succeeds());
  }
  MustSubmitMany("b", 3);
  MustSubmitAs("a", "right");
  EXPECT_THAT(Next(4), ::testing::ElementsAre("b1", "right", "b2", "b3"));
}

TEST_P(CatalogSuite, AJobThatIsTriedAgainKeepsItsTurn) {
  MustSubmitMany("a", 3);
  EXPECT_EQ(FailNext(absl::InternalError("odd")).import_animation().animation(), "a1");
  EXPECT_THAT(Next(1), ::testing::ElementsAre("a2"));
  now_ += absl::Seconds(1);
  EXPECT_THAT(Next(2), ::testing::ElementsAre("a1", "a3"));
}

TEST_P(CatalogSuite, ALostJobIsGivenOutInItsTurn) {
  MustSubmitAs("a", "a1");
  MustSubmitAs("b", "b1");  // of the same turn
  EXPECT_EQ(FailNext(absl::InternalError("odd")).import_animation().animation(), "a1");
  EXPECT_THAT(Next(1), ::testing::ElementsAre("b1"));
  MustSubmitAs("c", "c1");
  MustSubmitAs("c", "urgent", 1);
  now_ += kLease + absl::Seconds(2);
  EXPECT_THAT(Next(4), ::testing::ElementsAre("urgent", "a1", "b1", "c1"));
}

TEST_P(CatalogSuite, EachTargetOfARegistrationTakesATurn) {
  for (const std::string id : {"x", "y", "z"}) MakeAnimation(id);
  Job job = RegistrationOf("f", "x", {"x", "y", "z"});
  job.set_owner("a");
  job.set_priority(-1);
  ASSERT_THAT(catalog_->SubmitRegistration(job), Succeeds());
  MustSubmitAs("b", "b1", -1);
  EXPECT_EQ(MustLease().job.register_target().target_index(), 0);
  EXPECT_THAT(Next(1), ::testing::ElementsAre("b1"));
  EXPECT_EQ(MustLease().job.register_target().target_index(), 1);
  MustSubmitAs("a", "a1", -1);  // after the owner's last child
  MustSubmitAs("b", "b2", -1);
  EXPECT_EQ(MustLease().job.register_target().target_index(), 2);
  EXPECT_THAT(Next(2), ::testing::ElementsAre("b2", "a1"));
}

}  // namespace liquidblend::store
