#include "server/catalog/families.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <new>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/synchronization/barrier.h"
#include "core/store/blobs/mapped_file.h"
#include "core/store/files/files.h"
#include "tests/core/store/store_testing.h"
#include "tests/synthetic/families.h"

namespace liquidblend::catalog {
namespace {

using testing::AllOf;
using testing::HasSubstr;

// A blob store that counts how often blobs are opened.
class CountingBlobs : public store::BlobStore {
 public:
  explicit CountingBlobs(std::unique_ptr<store::BlobStore> blobs) : blobs_(std::move(blobs)) {}
  absl::StatusOr<std::unique_ptr<store::BlobWriter>> Create() override { return blobs_->Create(); }
  absl::StatusOr<std::unique_ptr<store::BlobWriter>> CreateAs(const store::BlobId& id) override {
    return blobs_->CreateAs(id);
  }
  absl::StatusOr<std::unique_ptr<store::BlobWriter>> CreateUpload() override {
    return blobs_->CreateUpload();
  }
  absl::StatusOr<std::shared_ptr<const store::Blob>> Open(const store::BlobId& id) override {
    ++num_opened;
    if (before_open) std::exchange(before_open, nullptr)();
    if (!failure.ok()) return failure;
    return blobs_->Open(id);
  }
  absl::Status Verify(const store::BlobId& id) override { return blobs_->Verify(id); }
  absl::Status Delete(const store::BlobId& id) override { return blobs_->Delete(id); }
  absl::StatusOr<bool> DeleteIfNotNewer(const store::BlobId& id, absl::Time time) override {
    return blobs_->DeleteIfNotNewer(id, time);
  }
  absl::StatusOr<std::string> Quarantine(const store::BlobId& id) override {
    return blobs_->Quarantine(id);
  }
  absl::StatusOr<std::vector<store::BlobInfo>> List() override { return blobs_->List(); }
  absl::StatusOr<std::string> ReadCatalogId() override { return blobs_->ReadCatalogId(); }
  absl::Status WriteCatalogId(const std::string& id) override { return blobs_->WriteCatalogId(id); }

  std::atomic<int> num_opened = 0;
  std::function<void()> before_open;  // once
  absl::Status failure;               // of Open()

 private:
  std::unique_ptr<store::BlobStore> blobs_;
};

class FamiliesTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = absl::StrCat(testing::TempDir(), "/families-XXXXXX");
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    directory_ = pattern;
    auto blobs = store::OpenLocalBlobStore(pattern);
    ASSERT_TRUE(blobs.ok()) << blobs.status();
    blobs_ = std::make_unique<CountingBlobs>(*std::move(blobs));
    auto catalog = store::OpenSqliteCatalog(pattern + "/catalog.sqlite");
    ASSERT_TRUE(catalog.ok()) << catalog.status();
    catalog_ = *std::move(catalog);
    ImportAnimation("a");
    ImportAnimation("b");
  }

  void TearDown() override {
    catalog_.reset();
    std::filesystem::remove_all(directory_);
  }

  store::Lease TakeJob() {
    auto lease = catalog_->LeaseJob("test", absl::Hours(1));
    EXPECT_TRUE(lease.ok() && lease->has_value()) << lease.status();
    return **lease;
  }

  store::BlobId Put(const std::string& bytes) {
    const auto id = store::PutBlob(*blobs_, std::as_bytes(std::span(bytes)));
    EXPECT_TRUE(id.ok()) << id.status();
    return *id;
  }

  void ImportAnimation(const std::string& id) {
    store::pb::AnimationRecord animation;
    animation.set_id(id);
    store::pb::JobRecord job;
    job.mutable_import_animation()->set_animation(id);
    const auto submitted = catalog_->SubmitImport(animation, job);
    ASSERT_TRUE(submitted.ok()) << submitted.status();
    animation.set_state(store::pb::AnimationRecord::READY);
    animation.set_blob(Put("animation " + id));
    const absl::Status published = catalog_->PublishAnimation(TakeJob().lease_id, animation);
    ASSERT_TRUE(published.ok()) << published;
  }

  void SubmitRegistration(const std::string& id, int keep_versions = 1) {
    store::pb::JobRecord job;
    job.mutable_register_family()->set_keep_versions(keep_versions);
    job.mutable_register_family()->set_family(id);
    job.mutable_register_family()->set_source("a");
    job.mutable_register_family()->add_targets("b");
    const auto submitted = catalog_->SubmitRegistration(job);
    ASSERT_TRUE(submitted.ok()) << submitted.status();
  }

  // Registers family `id` and publishes this blob as its next version.
  void Publish(const std::string& id, const store::BlobId& blob, int keep_versions = 1) {
    SubmitRegistration(id, keep_versions);
    store::pb::FamilyRecord record;
    record.set_id(id);
    record.set_blob(blob);
    const auto version = catalog_->PublishFamily(TakeJob().lease_id, record);
    ASSERT_TRUE(version.ok()) << version.status();
  }

  static mesh::RegisteredFamily MakeFamily(uint64_t seed, int cells_per_side = 4) {
    return synthetic::MakeFamily(synthetic::HexahedralSphere(cells_per_side),
                                 {{synthetic::Noise(seed, 0.1F, 0.5F), {}}});
  }

  // A family file; the seed makes it differ from others.
  store::BlobId PutFamily(uint64_t seed) { return PutFamily(MakeFamily(seed)); }

  store::BlobId PutFamily(const mesh::RegisteredFamily& family) {
    auto writer = blobs_->Create();
    EXPECT_TRUE(writer.ok()) << writer.status();
    const absl::Status written = store::WriteFamily(family, **writer);
    EXPECT_TRUE(written.ok()) << written;
    const auto id = (*writer)->Commit();
    EXPECT_TRUE(id.ok()) << id.status();
    return *id;
  }

  std::string directory_;
  std::unique_ptr<CountingBlobs> blobs_;
  std::unique_ptr<store::Catalog> catalog_;
};

// A registration publishes, and the collector deletes, between the look at the catalog and the
// file.
TEST_F(FamiliesTest, AVersionThatIsReplacedAndCollectedBeforeItIsOpenedGivesItsSuccessor) {
  for (const int64_t asked : {0, 1}) {
    const std::string id = absl::StrCat("splash", asked);
    const store::BlobId first = PutFamily(2 * asked + 1), second = PutFamily(2 * asked + 2);
    Publish(id, first);
    Families families(*catalog_, *blobs_);
    blobs_->before_open = [&] {
      Publish(id, second);
      ASSERT_TRUE(blobs_->Delete(first).ok());
    };
    const auto loaded = families.Get(id, asked);
    if (asked == 0) {
      ASSERT_TRUE(loaded.ok()) << loaded.status();
      EXPECT_EQ((*loaded)->family.version, 2);
    } else {
      EXPECT_EQ(loaded.status().code(), absl::StatusCode::kNotFound) << loaded.status();
      EXPECT_THAT(loaded.status().ToString(), HasSubstr("the published one is 2"));
    }
    EXPECT_EQ((*families.Get(id))->family.version, 2);
  }
}

TEST_F(FamiliesTest, AFamilyWhoseFileCannotBeReadAnyMoreIsLoadedAnew) {
  store::SurviveUnreadablePages();
  const store::BlobId blob = PutFamily(1);
  Publish("splash", blob);
  Families families(*catalog_, *blobs_);
  const auto loaded = families.Get("splash");
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  EXPECT_TRUE((*loaded)->CheckFile().ok());
  const std::string path = store::LocalBlobPath(directory_, blob);
  const std::string content = store::ReadFile(path);
  std::filesystem::permissions(path, std::filesystem::perms(0644));
  std::filesystem::resize_file(path, 0);
  EXPECT_EQ((*loaded)->family.vertices.front()[0], 0.0F);  // reads as zeros
  EXPECT_EQ((*loaded)->CheckFile().code(), absl::StatusCode::kDataLoss);
  EXPECT_EQ(families.Peek("splash", 0), nullptr);
  EXPECT_EQ(families.Get("splash").status().code(), absl::StatusCode::kDataLoss);
  store::WriteFile(path, content);
  const auto again = families.Get("splash");
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_TRUE((*again)->CheckFile().ok());
}

TEST_F(FamiliesTest, GetGivesThePublishedFamilyWithItsIndexAndGrid) {
  Publish("splash", PutFamily(1));
  Families families(*catalog_, *blobs_);
  const auto loaded = families.Get("splash");
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  EXPECT_EQ((*loaded)->family.version, 1);
  EXPECT_EQ((*loaded)->family.name, "splash");
  ASSERT_EQ((*loaded)->levels.size(), 1U);
  EXPECT_EQ(&(*loaded)->levels[0]->index.family(), &(*loaded)->family);
  EXPECT_EQ((*loaded)->family.hexahedra.size(), 6U * 16U * 9U);
  EXPECT_GT((*loaded)->levels[0]->index.num_clusters(), 0);
  EXPECT_FLOAT_EQ((*loaded)->grid.extent_m, 4.0F);
  EXPECT_EQ(families.size_bytes(), (*loaded)->size_bytes);
  EXPECT_GT((*loaded)->size_bytes, static_cast<int64_t>((*loaded)->family.hexahedra.size_bytes()));
}

TEST_F(FamiliesTest, EachLevelOfDetailHasAnIndexOfItsOwn) {
  mesh::RegisteredFamily family = MakeFamily(1);
  const mesh::RegisteredFamily coarse = MakeFamily(1, 2);
  family.coarser_levels = {coarse};
  Publish("splash", PutFamily(family));
  Families families(*catalog_, *blobs_);
  const auto loaded = families.Get("splash");
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  ASSERT_EQ((*loaded)->levels.size(), 2U);
  const frames::IndexedLevel& level = *(*loaded)->levels[1];
  EXPECT_EQ(&level.family, &(*loaded)->family.coarser_levels[0]);
  EXPECT_EQ(&level.index.family(), &level.family);
  EXPECT_EQ(level.family.vertices.size(), coarse.vertices.size());
  EXPECT_EQ(level.time_links.later().size(), coarse.vertices.size());
}

TEST_F(FamiliesTest, GetLoadsAFamilyOnlyOnce) {
  Publish("splash", PutFamily(1));
  Families families(*catalog_, *blobs_);
  const auto first = families.Get("splash");
  const auto second = families.Get("splash", 1);
  ASSERT_TRUE(first.ok() && second.ok());
  EXPECT_EQ(first->get(), second->get());
  EXPECT_EQ(blobs_->num_opened, 1);
}

TEST_F(FamiliesTest, ConcurrentGetsLoadOnce) {
  constexpr int kNumThreads = 8;
  Publish("splash", PutFamily(1));
  Families families(*catalog_, *blobs_);
  std::vector<std::shared_ptr<const LoadedFamily>> loaded(kNumThreads);
  {
    auto* barrier = new absl::Barrier(kNumThreads);
    std::vector<std::jthread> threads;
    for (int k = 0; k < kNumThreads; ++k) {
      threads.emplace_back([&, k] {
        if (barrier->Block()) delete barrier;
        const auto result = families.Get("splash");
        if (result.ok()) loaded[k] = *result;
      });
    }
  }
  ASSERT_NE(loaded[0], nullptr);
  for (const auto& family : loaded) EXPECT_EQ(family, loaded[0]);
  EXPECT_EQ(blobs_->num_opened, 1);
}

TEST_F(FamiliesTest, TheNextGetSeesANewVersionAndOldHandlesStayWhole) {
  Publish("splash", PutFamily(1));
  Families families(*catalog_, *blobs_);
  const auto old = families.Get("splash");
  ASSERT_TRUE(old.ok()) << old.status();
  const float before = (*old)->family.targets[0].displacement[5][0];

  Publish("splash", PutFamily(2));
  const auto now = families.Get("splash");
  ASSERT_TRUE(now.ok()) << now.status();
  EXPECT_EQ((*now)->family.version, 2);
  EXPECT_NE((*now)->family.targets[0].displacement[5][0], before);
  EXPECT_EQ((*old)->family.version, 1);
  EXPECT_EQ((*old)->family.targets[0].displacement[5][0], before);
  EXPECT_EQ(families.size_bytes(), (*now)->size_bytes);

  const auto gone = families.Get("splash", 1);
  EXPECT_EQ(gone.status().code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(gone.status().message()),
              AllOf(HasSubstr("splash"), HasSubstr("version 1"), HasSubstr("is 2")));
}

TEST_F(FamiliesTest, EvictsTheLeastRecentlyUsedThatNobodyHolds) {
  for (const char* id : {"f1", "f2", "f3"}) Publish(id, PutFamily(7));
  int64_t one = 0;
  {
    Families measure(*catalog_, *blobs_);
    one = (*measure.Get("f1"))->size_bytes;
  }
  FamiliesOptions options;
  options.memory_budget_bytes = 2 * one;
  Families families(*catalog_, *blobs_, options);
  ASSERT_TRUE(families.Get("f1").ok());
  ASSERT_TRUE(families.Get("f2").ok());
  ASSERT_TRUE(families.Get("f1").ok());  // f2 is the oldest now
  ASSERT_TRUE(families.Get("f3").ok());
  EXPECT_EQ(families.size_bytes(), 2 * one);

  const int before = blobs_->num_opened;
  ASSERT_TRUE(families.Get("f1").ok());
  ASSERT_TRUE(families.Get("f3").ok());
  EXPECT_EQ(blobs_->num_opened, before);
  ASSERT_TRUE(families.Get("f2").ok());
  EXPECT_EQ(blobs_->num_opened, before + 1);
}

TEST_F(FamiliesTest, WhatIsHeldIsNotEvicted) {
  Publish("f1", PutFamily(1));
  Publish("f2", PutFamily(2));
  FamiliesOptions options;
  options.memory_budget_bytes = 0;
  Families families(*catalog_, *blobs_, options);
  auto held = families.Get("f1");
  ASSERT_TRUE(held.ok());
  ASSERT_TRUE(families.Get("f2").ok());
  EXPECT_EQ(families.Get("f1")->get(), held->get());
  held = absl::CancelledError();  // let go
  ASSERT_TRUE(families.Get("f2").ok());
  const int before = blobs_->num_opened;
  ASSERT_TRUE(families.Get("f1").ok());
  EXPECT_EQ(blobs_->num_opened, before + 1);
}

TEST_F(FamiliesTest, AnUnknownFamilyIsNotFound) {
  Families families(*catalog_, *blobs_);
  EXPECT_EQ(families.Get("nothing").status().code(), absl::StatusCode::kNotFound);
}

TEST_F(FamiliesTest, ADeletedFamilyIsNotFoundAndLetGo) {
  Publish("splash", PutFamily(1));
  Families families(*catalog_, *blobs_);
  ASSERT_TRUE(families.Get("splash").ok());
  ASSERT_TRUE(catalog_->DeleteFamily("splash").ok());
  EXPECT_EQ(families.Get("splash").status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(families.size_bytes(), 0);
}

TEST_F(FamiliesTest, AFamilyWithNothingPublishedIsAFailedPrecondition) {
  SubmitRegistration("splash");
  Families families(*catalog_, *blobs_);
  const absl::Status status = families.Get("splash").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()), HasSubstr("splash"));
}

TEST_F(FamiliesTest, AMissingFileIsDataLossAndIsTriedAgain) {
  const store::BlobId blob = PutFamily(1);
  Publish("splash", blob);
  ASSERT_TRUE(blobs_->Delete(blob).ok());
  Families families(*catalog_, *blobs_);
  const absl::Status status = families.Get("splash").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(std::string(status.message()), HasSubstr("splash"));
  EXPECT_EQ(PutFamily(1), blob);  // restored
  EXPECT_TRUE(families.Get("splash").ok());
}

TEST_F(FamiliesTest, AFileThatIsNoFamilyIsDataLoss) {
  Publish("splash", Put("this is no family file"));
  Families families(*catalog_, *blobs_);
  EXPECT_EQ(families.Get("splash").status().code(), absl::StatusCode::kDataLoss);
}

// Keeps loads until they are asked for.
struct LateLoads {
  auto executor() {
    return [this](Families::Task task) {
      tasks.push_back(std::move(task));
      return true;
    };
  }
  void RunAll() {
    for (Families::Task& task : std::exchange(tasks, {})) task();
  }
  std::vector<Families::Task> tasks;
};

// What GetReady gives: nothing before `done` was called.
struct Answer {
  std::optional<absl::StatusOr<FamilyPtr>> result;
  Families::Done Done() {
    return [this](absl::StatusOr<FamilyPtr> found) { result = std::move(found); };
  }
  int64_t version() const {
    return result.has_value() && result->ok() ? (**result)->family.version : -1;
  }
  absl::StatusCode code() const {
    return result.has_value() ? result->status().code() : absl::StatusCode::kUnknown;
  }
};

TEST_F(FamiliesTest, ALoadThatCannotBeStartedTellsThoseWhoWait) {
  Publish("splash", PutFamily(1));
  Families families(*catalog_, *blobs_);
  const auto full = [](Families::Task) -> bool { throw std::bad_alloc(); };
  Answer answer;
  EXPECT_THROW(families.GetReady("splash", 0, full, answer.Done()), std::bad_alloc);
  EXPECT_EQ(answer.code(), absl::StatusCode::kUnavailable);
  EXPECT_TRUE(families.Get("splash").ok()) << "a later call begins anew";
}

TEST_F(FamiliesTest, TheOldVersionIsServedUntilTheNewOneIsReady) {
  Publish("splash", PutFamily(1));
  Families families(*catalog_, *blobs_);
  ASSERT_TRUE(families.Get("splash").ok());
  Publish("splash", PutFamily(2));
  LateLoads loads;
  Answer latest, old, fresh;
  families.GetReady("splash", 0, loads.executor(), latest.Done());
  families.GetReady("splash", 1, loads.executor(), old.Done());
  families.GetReady("splash", 2, loads.executor(), fresh.Done());
  EXPECT_EQ(latest.version(), 1);
  EXPECT_EQ(old.version(), 1);
  EXPECT_FALSE(fresh.result.has_value());  // waits
  ASSERT_EQ(loads.tasks.size(), 1U);       // all three load it once
  loads.RunAll();
  EXPECT_EQ(fresh.version(), 2);
  families.GetReady("splash", 0, loads.executor(), latest.Done());
  families.GetReady("splash", 1, loads.executor(), old.Done());
  EXPECT_EQ(latest.version(), 2);
  EXPECT_EQ(old.code(), absl::StatusCode::kNotFound);
}

TEST_F(FamiliesTest, WhoeverKnowsOfANewerVersionWaitsForIt) {
  Publish("splash", PutFamily(1));
  Families families(*catalog_, *blobs_);
  ASSERT_TRUE(families.Get("splash").ok());
  Publish("splash", PutFamily(2));
  LateLoads loads;
  Answer any, newer, missing;
  EXPECT_EQ(families.Peek("splash", {0, 2}), nullptr);
  families.GetReady("splash", {0, 1}, loads.executor(), any.Done());
  families.GetReady("splash", {0, 2}, loads.executor(), newer.Done());
  families.GetReady("splash", {0, 3}, loads.executor(), missing.Done());
  EXPECT_EQ(any.version(), 1);
  EXPECT_FALSE(newer.result.has_value());  // waits
  EXPECT_EQ(missing.code(), absl::StatusCode::kNotFound);
  loads.RunAll();
  EXPECT_EQ(newer.version(), 2);
  EXPECT_NE(families.Peek("splash", {0, 2}), nullptr);
}

TEST_F(FamiliesTest, KeptVersionsAreLoadedBesideThePublishedOne) {
  Publish("splash", PutFamily(1), 2);
  Publish("splash", PutFamily(2), 2);
  Families families(*catalog_, *blobs_);
  LateLoads loads;
  Answer kept;
  families.GetReady("splash", 1, loads.executor(), kept.Done());
  EXPECT_FALSE(kept.result.has_value());
  loads.RunAll();
  EXPECT_EQ(kept.version(), 1);
  EXPECT_EQ(families.Peek("splash", 0), nullptr) << "the published one is not in memory";
  EXPECT_EQ((*families.Get("splash"))->family.version, 2);
  ASSERT_NE(families.Peek("splash", 1), nullptr);
  EXPECT_EQ(families.Peek("splash", 1)->family.version, 1);
  EXPECT_EQ(families.Peek("splash", 2)->family.version, 2);
  EXPECT_EQ((*families.Get("splash", 1))->family.version, 1);
  EXPECT_EQ(families.SizesBytes().size(), 1U);
  families.Refresh(loads.executor());
  EXPECT_NE(families.Peek("splash", 1), nullptr);
  EXPECT_TRUE(loads.tasks.empty());
}

TEST_F(FamiliesTest, VersionsThatAreNotKeptAnyMoreAreForgotten) {
  Publish("splash", PutFamily(1), 2);
  Publish("splash", PutFamily(2), 2);
  Families families(*catalog_, *blobs_);
  LateLoads loads;
  ASSERT_TRUE(families.Get("splash", 1).ok());
  Publish("splash", PutFamily(3), 2);
  families.Refresh(loads.executor());
  EXPECT_EQ(families.Peek("splash", 1), nullptr);
  EXPECT_EQ(families.Get("splash", 1).status().code(), absl::StatusCode::kNotFound);
  ASSERT_TRUE(families.Get("splash", 2).ok());
  ASSERT_TRUE(catalog_->DeleteFamily("splash").ok());
  EXPECT_NE(families.Peek("splash", 2), nullptr);
  families.Forget("splash");
  EXPECT_EQ(families.Peek("splash", 2), nullptr);
}

TEST_F(FamiliesTest, IsBehindUntilTheNewerVersionIsLoaded) {
  Publish("splash", PutFamily(1));
  Families families(*catalog_, *blobs_);
  LateLoads loads;
  EXPECT_FALSE(families.IsBehind("splash", 1, loads.executor())) << "it is not in memory";
  ASSERT_TRUE(families.Get("splash").ok());
  EXPECT_FALSE(families.IsBehind("splash", 1, loads.executor()));
  Publish("splash", PutFamily(2));
  EXPECT_TRUE(families.IsBehind("splash", 2, loads.executor()));
  EXPECT_TRUE(families.IsBehind("splash", 2, loads.executor()));
  EXPECT_EQ(loads.tasks.size(), 1U);
  loads.RunAll();
  EXPECT_FALSE(families.IsBehind("splash", 2, loads.executor()));
}

TEST_F(FamiliesTest, IsNotBehindAVersionThatCannotBeLoaded) {
  Publish("splash", PutFamily(1));
  Families families(*catalog_, *blobs_);
  ASSERT_TRUE(families.Get("splash").ok());
  Publish("splash", Put("no family"));
  LateLoads loads;
  EXPECT_TRUE(families.IsBehind("splash", 2, loads.executor()));
  loads.RunAll();
  EXPECT_FALSE(families.IsBehind("splash", 2, loads.executor()));
}

TEST_F(FamiliesTest, IsBehindWhileAnOlderVersionIsBeingLoaded) {
  Publish("splash", PutFamily(1));
  Families families(*catalog_, *blobs_);
  LateLoads loads;
  Answer first;
  families.GetReady("splash", 0, loads.executor(), first.Done());
  Publish("splash", PutFamily(2));
  EXPECT_TRUE(families.IsBehind("splash", 2, loads.executor()));
  EXPECT_EQ(loads.tasks.size(), 2U) << "the newer one is not put off";
  loads.RunAll();
  EXPECT_FALSE(families.IsBehind("splash", 2, loads.executor()));
  EXPECT_EQ(first.version(), 1);
  ASSERT_NE(families.Peek("splash", 0), nullptr);
  EXPECT_EQ(families.Peek("splash", 0)->family.version, 2);
}

TEST_F(FamiliesTest, IsBehindAVersionWhoseStoreIsAwayForAWhile) {
  for (const absl::Duration patience : {absl::ZeroDuration(), absl::Hours(1)}) {
    const std::string id = absl::StrCat("splash", absl::ToInt64Hours(patience));
    Publish(id, PutFamily(1));
    Families families(*catalog_, *blobs_, {.transient_failure_patience = patience});
    ASSERT_TRUE(families.Get(id).ok());
    Publish(id, PutFamily(2));
    LateLoads loads;
    blobs_->failure = absl::UnavailableError("the store is away");
    EXPECT_TRUE(families.IsBehind(id, 2, loads.executor()));
    loads.RunAll();
    EXPECT_EQ(families.IsBehind(id, 2, loads.executor()), patience > absl::ZeroDuration());
    EXPECT_TRUE(loads.tasks.empty()) << "not again so soon";
    blobs_->failure = absl::OkStatus();
    ASSERT_TRUE(families.Get(id).ok());
    EXPECT_FALSE(families.IsBehind(id, 2, loads.executor()));
  }
}

TEST_F(FamiliesTest, RefreshLoadsNewVersionsBeforeAnybodyAsks) {
  Publish("splash", PutFamily(1));
  Publish("other", PutFamily(3));
  Families families(*catalog_, *blobs_);
  ASSERT_TRUE(families.Get("splash").ok());
  Publish("splash", PutFamily(2));
  LateLoads loads;
  families.Refresh(loads.executor());
  EXPECT_EQ(loads.tasks.size(), 1U);  // not of families that nobody has asked for
  loads.RunAll();
  const int before = blobs_->num_opened;
  EXPECT_EQ((*families.Get("splash"))->family.version, 2);
  EXPECT_EQ(blobs_->num_opened, before);
  ASSERT_TRUE(catalog_->DeleteFamily("splash").ok());
  families.Refresh(loads.executor());
  EXPECT_EQ(families.size_bytes(), 0);
}

TEST_F(FamiliesTest, PeekGivesWhatIsInMemoryAndAsksNobody) {
  Publish("splash", PutFamily(1));
  Families families(*catalog_, *blobs_);
  EXPECT_EQ(families.Peek("splash", 0), nullptr);
  const auto loaded = families.Get("splash");
  ASSERT_TRUE(loaded.ok()) << loaded.status();
  EXPECT_EQ(families.Peek("splash", 0), *loaded);
  EXPECT_EQ(families.Peek("splash", 1), *loaded);
  EXPECT_EQ(families.Peek("splash", 2), nullptr);
  EXPECT_EQ(families.Peek("other", 0), nullptr);

  Publish("splash", PutFamily(2));
  EXPECT_EQ(families.Peek("splash", 0), *loaded);
  LateLoads loads;
  families.Refresh(loads.executor());
  EXPECT_EQ(families.Peek("splash", 0), *loaded) << "until the next one is ready";
  EXPECT_EQ(families.Peek("splash", 2), nullptr);
  loads.RunAll();
  EXPECT_EQ(families.Peek("splash", 2), *families.Get("splash"));

  ASSERT_TRUE(catalog_->DeleteFamily("splash").ok());
  EXPECT_NE(families.Peek("splash", 0), nullptr);
  families.Forget("splash");
  EXPECT_EQ(families.Peek("splash", 0), nullptr);
}

// Calls that find their family in memory look into no catalog, and let go of nothing.
TEST_F(FamiliesTest, RefreshKeepsToTheBudget) {
  Publish("f1", PutFamily(1));
  Publish("f2", PutFamily(2));
  Families families(*catalog_, *blobs_, {.memory_budget_bytes = 1});
  LateLoads loads;
  {
    const auto first = families.Get("f1"), second = families.Get("f2");
    ASSERT_TRUE(first.ok() && second.ok());
    families.Refresh(loads.executor());
    EXPECT_EQ(families.SizesBytes().size(), 2u) << "both are held";
  }
  EXPECT_NE(families.Peek("f1", 0), nullptr);
  EXPECT_EQ(families.SizesBytes().size(), 2u);
  families.Refresh(loads.executor());
  EXPECT_TRUE(families.SizesBytes().empty());
}

TEST_F(FamiliesTest, PeekCountsAsUse) {
  Publish("f1", PutFamily(1));
  Publish("f2", PutFamily(2));
  Publish("f3", PutFamily(3));
  int64_t size = 0;
  {
    Families families(*catalog_, *blobs_);
    ASSERT_TRUE(families.Get("f1").ok());
    size = families.size_bytes();
  }
  Families families(*catalog_, *blobs_, {.memory_budget_bytes = 5 * size / 2});
  ASSERT_TRUE(families.Get("f1").ok());
  ASSERT_TRUE(families.Get("f2").ok());
  ASSERT_NE(families.Peek("f1", 0), nullptr);
  ASSERT_TRUE(families.Get("f3").ok());
  EXPECT_NE(families.Peek("f1", 0), nullptr);
  EXPECT_EQ(families.Peek("f2", 0), nullptr);
}

TEST_F(FamiliesTest, ANewVersionThatCannotBeLoadedLeavesTheOldOneServed) {
  Publish("splash", PutFamily(1));
  Families families(*catalog_, *blobs_);
  ASSERT_TRUE(families.Get("splash").ok());
  Publish("splash", Put("this is no family file"));
  LateLoads loads;
  Answer latest, fresh;
  families.GetReady("splash", 0, loads.executor(), latest.Done());
  loads.RunAll();
  families.GetReady("splash", 0, loads.executor(), latest.Done());
  EXPECT_EQ(latest.version(), 1);
  EXPECT_TRUE(loads.tasks.empty());  // not again so soon
  families.GetReady("splash", 2, loads.executor(), fresh.Done());
  loads.RunAll();
  EXPECT_EQ(fresh.code(), absl::StatusCode::kDataLoss);
}

TEST_F(FamiliesTest, ANamesakeOfADeletedFamilyIsNotMistakenForIt) {
  Publish("splash", PutFamily(1));
  Families families(*catalog_, *blobs_);
  const std::string generation = (*families.Get("splash"))->generation;
  ASSERT_TRUE(catalog_->DeleteFamily("splash").ok());
  Publish("splash", PutFamily(2));
  LateLoads loads;
  Answer latest;
  families.GetReady("splash", 0, loads.executor(), latest.Done());
  EXPECT_FALSE(latest.result.has_value());
  loads.RunAll();
  ASSERT_GT(latest.version(), 0);
  EXPECT_NE((**latest.result)->generation, generation);
}

TEST_F(FamiliesTest, ADeletedFamilyIsNotServedWhileItsNamesakeIsRegistered) {
  Publish("splash", PutFamily(1));
  Families families(*catalog_, *blobs_);
  ASSERT_TRUE(families.Get("splash").ok());
  ASSERT_TRUE(catalog_->DeleteFamily("splash").ok());
  SubmitRegistration("splash");
  LateLoads loads;
  families.Refresh(loads.executor());
  EXPECT_EQ(families.Peek("splash", 0), nullptr);
  EXPECT_EQ(families.size_bytes(), 0);
  EXPECT_EQ(families.Get("splash").status().code(), absl::StatusCode::kFailedPrecondition);
}

TEST_F(FamiliesTest, ADeletedFamilyIsNotServedUntilItsNamesakeIsReady) {
  Publish("splash", PutFamily(1));
  Families families(*catalog_, *blobs_);
  ASSERT_TRUE(families.Get("splash").ok());
  ASSERT_TRUE(catalog_->DeleteFamily("splash").ok());
  Publish("splash", PutFamily(2));
  LateLoads loads;
  families.Refresh(loads.executor());
  EXPECT_EQ(families.Peek("splash", 0), nullptr);
}

TEST_F(FamiliesTest, AFamilyThatIsRegisteredAgainIsServedMeanwhile) {
  Publish("splash", PutFamily(1));
  Families families(*catalog_, *blobs_);
  ASSERT_TRUE(families.Get("splash").ok());
  SubmitRegistration("splash");
  LateLoads loads;
  families.Refresh(loads.executor());
  EXPECT_NE(families.Peek("splash", 0), nullptr);
  EXPECT_EQ((*families.Get("splash"))->family.version, 1);
}

// Such a call gets what it has read about, and later calls do not.
TEST_F(FamiliesTest, ACallThatBeganBeforeARollbackDoesNotBringTheVersionBack) {
  Publish("splash", PutFamily(1), 2);
  Publish("splash", PutFamily(2), 2);
  Families families(*catalog_, *blobs_);
  families.Forget("splash", 3);
  EXPECT_EQ((*families.Get("splash"))->family.version, 2);
  EXPECT_EQ(families.Peek("splash", 0), nullptr);
  ASSERT_TRUE(catalog_->RollbackFamily("splash", 1, 2).ok());
  EXPECT_EQ((*families.Get("splash"))->family.version, 3);
  ASSERT_NE(families.Peek("splash", 0), nullptr);
  EXPECT_EQ(families.Peek("splash", 0)->family.version, 3);
}

TEST_F(FamiliesTest, ARolledBackFamilyOfARestoredStoreIsServedAgain) {
  Publish("splash", PutFamily(1));
  Families families(*catalog_, *blobs_);
  families.Forget("splash", 3);
  LateLoads loads;
  families.Refresh(loads.executor());
  ASSERT_TRUE(families.Get("splash").ok());
  EXPECT_NE(families.Peek("splash", 0), nullptr);
}

TEST_F(FamiliesTest, AnOvertakenLoadServesOnlyThoseWhoAskedForIt) {
  Publish("splash", PutFamily(1));
  Families families(*catalog_, *blobs_);
  LateLoads loads;
  Answer first, second;
  families.GetReady("splash", 0, loads.executor(), first.Done());
  Publish("splash", PutFamily(2));
  families.GetReady("splash", 0, loads.executor(), second.Done());
  ASSERT_EQ(loads.tasks.size(), 2U);
  std::swap(loads.tasks[0], loads.tasks[1]);
  loads.RunAll();
  EXPECT_EQ(first.version(), 1);
  EXPECT_EQ(second.version(), 2);
  EXPECT_EQ((*families.Get("splash"))->family.version, 2);
}

TEST_F(FamiliesTest, AnExecutorThatHasStoppedIsAnError) {
  Publish("splash", PutFamily(1));
  Families families(*catalog_, *blobs_);
  Answer answer;
  families.GetReady(
      "splash", 0, [](const Families::Task&) { return false; }, answer.Done());
  EXPECT_EQ(answer.code(), absl::StatusCode::kUnavailable);
  EXPECT_TRUE(families.Get("splash").ok());
}

TEST(FamiliesOptions, NamesTheFieldAtFault) {
  FamiliesOptions options;
  EXPECT_TRUE(options.Validate().ok());
  options.memory_budget_bytes = -1;
  EXPECT_THAT(std::string(options.Validate().message()), HasSubstr("memory_budget_bytes is -1"));
  options = {.transient_failure_patience = -absl::Seconds(1)};
  EXPECT_THAT(std::string(options.Validate().message()),
              HasSubstr("transient_failure_patience is -1s"));
}

}  // namespace
}  // namespace liquidblend::catalog
