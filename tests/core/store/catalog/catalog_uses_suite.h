// CatalogSuite: how much families are asked for. Included by catalog_suite.h.
#pragma once

#include <string>
#include <vector>

#include "tests/core/store/catalog/catalog_testing.h"

namespace liquidblend::store {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

// The families in the order of their use.
inline std::vector<std::string> MostUsed(Catalog& catalog, int max_num = 10) {
  const auto used = catalog.ListMostUsedFamilies(max_num);
  EXPECT_THAT(used, Succeeds());
  std::vector<std::string> ids;
  if (!used.ok()) return ids;
  for (const UsedFamily& family : *used) ids.push_back(family.id);
  return ids;
}

TEST_P(CatalogSuite, ListsTheFamiliesThatAreAskedForMostFirst) {
  MakeAnimation("a");
  for (const std::string id : {"f", "g", "h", "unused"}) MakeFamily(id, "a", {"a"});
  EXPECT_THAT(MostUsed(*catalog_), IsEmpty());
  EXPECT_THAT(catalog_->RecordFamilyUses({{"f", 10}, {"g", 30}, {"h", 20}}), Succeeds());
  EXPECT_THAT(MostUsed(*catalog_), ElementsAre("g", "h", "f"));
  EXPECT_THAT(catalog_->RecordFamilyUses({{"f", 25}, {"nothing", 100}}), Succeeds());
  EXPECT_THAT(MostUsed(*catalog_), ElementsAre("f", "g", "h"));
  EXPECT_THAT(MostUsed(*catalog_, 1), ElementsAre("f"));
}

TEST_P(CatalogSuite, SaysHowLargeAUsedFamilyIs) {
  MakeAnimation("a");
  MustSubmitRegistration("f", "a", {"a"});
  EXPECT_THAT(catalog_->RecordFamilyUses({{"f", 1}}), Succeeds());
  EXPECT_THAT(MostUsed(*catalog_), IsEmpty());  // nothing is published yet
  pb::FamilyRecord family;
  family.set_id("f");
  family.set_blob("blob-of-f");
  family.set_size_bytes(1234);
  ASSERT_THAT(catalog_->PublishFamily(MustLease().lease_id, family), Succeeds());
  const auto used = catalog_->ListMostUsedFamilies(10);
  ASSERT_THAT(used, Succeeds());
  ASSERT_EQ(used->size(), 1);
  EXPECT_EQ((*used)[0].size_bytes, 1234);
}

TEST_P(CatalogSuite, ForgetsUsesWithinAWeek) {
  MakeAnimation("a");
  for (const std::string id : {"f", "g"}) MakeFamily(id, "a", {"a"});
  EXPECT_THAT(catalog_->RecordFamilyUses({{"f", 30}}), Succeeds());
  now_ += absl::Hours(24);
  EXPECT_THAT(catalog_->RecordFamilyUses({{"g", 20}}), Succeeds());
  EXPECT_THAT(MostUsed(*catalog_), ElementsAre("g", "f"));  // 20 of today, 30 / 2 of yesterday
  now_ += 6 * absl::Hours(24);
  EXPECT_THAT(MostUsed(*catalog_), ElementsAre("g"));
  now_ -= 7 * absl::Hours(24);  // the clock is set back
  EXPECT_THAT(MostUsed(*catalog_), ElementsAre("f"));
}

TEST_P(CatalogSuite, ForgetsTheUsesOfADeletedFamily) {
  MakeAnimation("a");
  MakeFamily("f", "a", {"a"});
  EXPECT_THAT(catalog_->RecordFamilyUses({{"f", 30}}), Succeeds());
  ASSERT_THAT(catalog_->DeleteFamily("f"), Succeeds());
  EXPECT_THAT(MostUsed(*catalog_), IsEmpty());
  MakeFamily("f", "a", {"a"});
  EXPECT_THAT(MostUsed(*catalog_), IsEmpty());
}

}  // namespace liquidblend::store
