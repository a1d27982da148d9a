// CatalogSuite: lists whose records are long. Included by catalog_suite.h.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "core/base/data_limit.h"
#include "tests/allocation_testing.h"
#include "tests/core/store/catalog/catalog_testing.h"

namespace liquidblend::store {

inline constexpr int64_t kMebibyte = 1 << 20;

// A registration, called `family`, whose record has 4 MB.
inline pb::JobRecord LongRegistration(const std::string& family) {
  pb::JobRecord job = RegistrationOf(family, "a", {"b"});
  auto& list = *job.mutable_register_family()->add_correspondences();
  for (int k = 0; k < 55'000; ++k) {
    pb::Correspondence& correspondence = *list.add_correspondences();
    for (int i = 0; i < 4; ++i) {
      correspondence.add_source(k);
      correspondence.add_target(i);
    }
  }
  return job;
}

// Sizes of the records of each page of a list, which has them all once.
template <typename ListPage>
std::vector<std::vector<int64_t>> SizesOfPages(const ListPage& list) {
  std::vector<std::vector<int64_t>> sizes;
  std::vector<std::string> ids;
  std::string token;
  do {
    const auto page = list(token);
    EXPECT_THAT(page, Succeeds());
    if (!page.ok()) break;
    EXPECT_EQ(page->tokens.size(), page->records.size());
    sizes.emplace_back();
    for (const auto& record : page->records) {
      sizes.back().push_back(static_cast<int64_t>(record.ByteSizeLong()));
      ids.push_back(record.id());
    }
    token = page->next_page_token;
  } while (!token.empty());
  std::sort(ids.begin(), ids.end());
  EXPECT_EQ(std::unique(ids.begin(), ids.end()), ids.end());
  return sizes;
}

// A little less than so many MiB.
inline std::string TextOf(int mebibytes) {
  return std::string(std::max<int64_t>(0, mebibytes * kMebibyte - 2048), 'x');
}

inline void ExpectFullPages(const std::vector<std::vector<int64_t>>& pages) {
  std::vector<std::vector<int64_t>> mebibytes = pages;
  for (auto& page : mebibytes) {
    for (int64_t& size : page) size /= kMebibyte - 4096;
  }
  using ::testing::ElementsAre;
  EXPECT_THAT(mebibytes, ElementsAre(ElementsAre(1, 2, 1), ElementsAre(3, 0), ElementsAre(6),
                                     ElementsAre(0, 1)));
}

TEST_P(CatalogSuite, EndsAPageByTheBytesOfItsRecords) {
  CatalogContents contents;
  const std::vector<int> mebibytes = {1, 2, 1, 3, 0, 6, 0, 1};
  for (int k = 0; k < std::ssize(mebibytes); ++k) {
    const std::string text = TextOf(mebibytes[k]);
    contents.animations.emplace_back().set_id(absl::StrCat("a", k));
    contents.animations.back().mutable_error()->set_message(text);
    contents.families.emplace_back().set_id(absl::StrCat("f", k));
    contents.families.back().mutable_failed_registration()->mutable_error()->set_message(text);
    pb::JobRecord job = ImportOf(contents.animations.back().id());
    job.set_id(absl::StrCat("j", k));
    job.set_state(Job::CANCELLED);
    job.mutable_import_animation()->mutable_files(0)->set_name(text);
    contents.jobs.insert(contents.jobs.begin(), job);
  }
  ASSERT_THAT(catalog_->Import(contents), Succeeds());
  ExpectFullPages(
      SizesOfPages([&](const std::string& token) { return catalog_->ListAnimations(0, token); }));
  ExpectFullPages(
      SizesOfPages([&](const std::string& token) { return catalog_->ListFamilies(0, token); }));
  ExpectFullPages(
      SizesOfPages([&](const std::string& token) { return catalog_->ListJobs(0, token); }));
  EXPECT_EQ(catalog_->ListJobs(1, "")->records.size(), 1);
}

TEST_P(CatalogSuite, GivesATokenForThePageAfterEachRecord) {
  for (const std::string id : {"a", "b", "c"}) MustSubmitImport(id);
  const auto all = catalog_->ListJobs(0, "");
  ASSERT_EQ(all->tokens.size(), 3);
  EXPECT_EQ(catalog_->ListJobs(1, all->tokens[0])->records[0].id(), all->records[1].id());
  EXPECT_EQ(catalog_->ListJobs(1, all->tokens[1])->records[0].id(), all->records[2].id());
  EXPECT_TRUE(catalog_->ListJobs(1, all->tokens[2])->records.empty());
  EXPECT_EQ(
      catalog_->ListAnimations(1, catalog_->ListAnimations(0, "")->tokens[1])->records[0].id(),
      "c");
}

// 24 jobs of 4 MB each, which would be 250 MB in memory, and more with PostgreSQL.
TEST_P(CatalogSuite, ReadsLongRecordsInLittleMemory) {
  LB_SKIP_UNLESS_ALLOCATIONS_MAY_FAIL();
  constexpr int kNumJobs = 24;
  for (const std::string id : {"a", "b"}) MakeAnimation(id);
  pb::JobRecord job = LongRegistration("");
  std::vector<std::string> ids;
  for (int k = 0; k < kNumJobs; ++k) {
    job.mutable_register_family()->set_family(absl::StrCat("f", k));
    const auto submitted = catalog_->SubmitRegistration(job);
    ASSERT_THAT(submitted, Succeeds());
    ids.push_back(submitted->id());
  }
  const auto in_little_memory = [&](const std::function<bool(Catalog&)>& is_right) {
    const int status = RunChild([&] {
      const auto catalog = backend_->Open(Options());
      const base::ScopedDataLimit limit(80 * kMebibyte);
      return limit.is_set() && is_right(*catalog) ? 0 : 1;
    });
    return status == 0;
  };
  const auto has_all = [](const auto& jobs) { return jobs.ok() && jobs->size() == kNumJobs; };
  const auto lists_page = [](Catalog& catalog) {
    const auto page = catalog.ListJobs(1000, "");
    return page.ok() && page->records.size() == 1 && !page->next_page_token.empty();
  };
  EXPECT_TRUE(in_little_memory(lists_page));
  EXPECT_TRUE(in_little_memory([&](Catalog& catalog) {
    return has_all(catalog.ListUnfinishedJobs()) &&
           absl::IsFailedPrecondition(catalog.DeleteAnimation("b"));
  }));
  for (const std::string& id : ids) ASSERT_THAT(catalog_->RequestCancel(id), Succeeds());
  EXPECT_TRUE(in_little_memory([&](Catalog& catalog) {
    return has_all(catalog.ListEndedJobs(now_ - absl::Seconds(1), kNumJobs));
  }));
}

TEST_P(CatalogSuite, LeavesTheListsOfRequestsOutOfReportsOfJobs) {
  for (const std::string id : {"a", "b"}) MakeAnimation(id);
  pb::JobRecord import = ImportOf("c");
  import.mutable_import_animation()->mutable_options()->add_frame_times(1.5);
  import.mutable_import_animation()->mutable_options()->set_frames_per_second(24);
  ASSERT_THAT(catalog_->SubmitImport(AnimationCalled("c"), import), Succeeds());
  ASSERT_THAT(catalog_->SubmitRegistration(LongRegistration("f")), Succeeds());
  const auto check = [](const Job& imported, const Job& registered) {
    EXPECT_EQ(imported.import_animation().animation(), "c");
    EXPECT_EQ(imported.import_animation().options().frames_per_second(), 24);
    EXPECT_EQ(imported.import_animation().options().frame_times_size(), 0);
    EXPECT_EQ(imported.import_animation().files_size(), 0);
    EXPECT_EQ(registered.register_family().targets(0), "b");
    EXPECT_EQ(registered.register_family().correspondences_size(), 0);
  };
  const auto unfinished = catalog_->ListUnfinishedJobs();
  ASSERT_EQ(unfinished->size(), 2);
  check((*unfinished)[0].job, (*unfinished)[1].job);
  for (const HeldJob& held : *unfinished) {
    now_ += absl::Seconds(1);
    ASSERT_THAT(catalog_->RequestCancel(held.job.id()), Succeeds());
    EXPECT_NE(GetJob(held.job.id()).import_animation().files_size() +
                  GetJob(held.job.id()).register_family().correspondences_size(),
              0);
  }
  const auto ended = catalog_->ListEndedJobs(now_ - absl::Seconds(2), 10);
  ASSERT_EQ(ended->size(), 2);
  check((*ended)[1], (*ended)[0]);
}

TEST_P(CatalogSuite, ListsAsManyJobsThatEndedAtOnceAsAskedFor) {
  for (const std::string id : {"a", "b", "c"}) {
    ASSERT_THAT(catalog_->RequestCancel(MustSubmitImport(id).id()), Succeeds());
  }
  EXPECT_EQ(catalog_->ListEndedJobs(now_ - absl::Seconds(1), 2)->size(), 2);
  EXPECT_EQ(catalog_->ListEndedJobs(now_ - absl::Seconds(1), 10)->size(), 3);
  EXPECT_EQ(catalog_->ListEndedJobs(absl::InfinitePast(), 10)->size(), 3);
  EXPECT_TRUE(catalog_->ListEndedJobs(now_, 10)->empty());
}

}  // namespace liquidblend::store
