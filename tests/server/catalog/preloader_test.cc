#include "server/catalog/preloader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/catalog/family_uses.h"
#include "tests/server/backends_testing.h"

namespace liquidblend::catalog {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// Tasks that run when the test says so.
class Tasks {
 public:
  Preloader::Post Post() {
    return [this](Families::Task task) {
      tasks_.push_back(std::move(task));
      return true;
    };
  }

  bool RunOne() {
    if (tasks_.empty()) return false;
    Families::Task task = std::move(tasks_.front());
    tasks_.pop_front();
    task();
    return true;
  }

  size_t num_waiting() const { return tasks_.size(); }

 private:
  std::deque<Families::Task> tasks_;
};

class PreloaderTest : public server::RpcTest {
 protected:
  PreloaderTest() {
    ImportAnimation("a");
    ImportAnimation("b");
    for (const std::string id : {"one", "two", "three", "unused"}) PublishFamily(id, "a", "b");
    EXPECT_TRUE(catalog_->RecordFamilyUses({{"one", 1}, {"two", 3}, {"three", 2}}).ok());
  }

  void Start(Families& families) {
    preloader_ = std::make_shared<Preloader>(*catalog_, families);
    preloader_->Start(asks_.Post(), loads_.Post(), [this] { ++num_ends_; });
  }

  // Until nothing is left to do.
  void RunAll() {
    while (asks_.RunOne() || loads_.RunOne()) {
    }
  }

  static std::vector<std::string> Loaded(const Families& families) {
    std::vector<std::string> ids;
    for (const auto& [id, bytes] : families.SizesBytes()) ids.push_back(id);
    return ids;
  }

  Tasks asks_, loads_;
  std::shared_ptr<Preloader> preloader_;
  int num_ends_ = 0;
};

TEST_F(PreloaderTest, LoadsWhatIsAskedForAndNothingElse) {
  Start(families_);
  EXPECT_THAT(preloader_->CheckIsOver().ToString(), HasSubstr("0 of 0 are there"));
  RunAll();
  EXPECT_EQ(num_ends_, 1);
  EXPECT_TRUE(preloader_->CheckIsOver().ok());
  EXPECT_THAT(Loaded(families_), ElementsAre("one", "three", "two"));
}

TEST_F(PreloaderTest, LoadsTheMostAskedForFirstAndSaysHowFarItIs) {
  Start(families_);
  while (loads_.num_waiting() < Preloader::kNumAtOnce) ASSERT_TRUE(asks_.RunOne());
  EXPECT_THAT(preloader_->CheckIsOver().ToString(), HasSubstr("0 of 3 are there"));
  loads_.RunOne();
  EXPECT_THAT(Loaded(families_), ElementsAre("two"));
  EXPECT_THAT(preloader_->CheckIsOver().ToString(), HasSubstr("1 of 3 are there"));
  loads_.RunOne();
  EXPECT_THAT(Loaded(families_), ElementsAre("three", "two"));
  EXPECT_EQ(num_ends_, 0);
}

TEST_F(PreloaderTest, BeginsNoMoreOnceItsTimeIsOver) {
  Start(families_);
  while (loads_.num_waiting() < Preloader::kNumAtOnce) ASSERT_TRUE(asks_.RunOne());
  preloader_->Stop();
  EXPECT_EQ(num_ends_, 1);
  EXPECT_TRUE(preloader_->CheckIsOver().ok());
  RunAll();
  preloader_->Stop();
  EXPECT_EQ(num_ends_, 1);
  EXPECT_THAT(Loaded(families_), ElementsAre("three", "two"));  // those that had begun
}

TEST_F(PreloaderTest, LeavesOutWhatDoesNotFitTheMemory) {
  const auto two = families_.Get("two");
  ASSERT_TRUE(two.ok()) << two.status();
  FamiliesOptions options;
  options.memory_budget_bytes = 5 * (*two)->size_bytes / 2;
  Families families(*catalog_, *blobs_, options);
  Start(families);
  RunAll();
  EXPECT_EQ(num_ends_, 1);
  EXPECT_THAT(Loaded(families), ElementsAre("three", "two"));
}

TEST_F(PreloaderTest, LeavesOutAFamilyThatIsDamaged) {
  ASSERT_TRUE(blobs_->Delete(catalog_->GetFamily("two")->blob()).ok());
  Start(families_);
  RunAll();
  EXPECT_EQ(num_ends_, 1);
  EXPECT_THAT(Loaded(families_), ElementsAre("one", "three"));
}

TEST_F(PreloaderTest, IsOverAtOnceIfNothingWasAskedFor) {
  for (const std::string id : {"one", "two", "three"}) ASSERT_TRUE(catalog_->DeleteFamily(id).ok());
  Start(families_);
  RunAll();
  EXPECT_EQ(num_ends_, 1);
  EXPECT_THAT(Loaded(families_), IsEmpty());
}

TEST_F(PreloaderTest, IsOverIfThereAreNoMoreThreads) {
  preloader_ = std::make_shared<Preloader>(*catalog_, families_);
  const auto refuse = [](const Families::Task&) { return false; };
  preloader_->Start(refuse, refuse, [this] { ++num_ends_; });
  EXPECT_EQ(num_ends_, 1);
}

TEST_F(PreloaderTest, UsesAreAddedToThoseOfTheCatalog) {
  FamilyUses uses;
  uses.Record(*catalog_);  // nothing yet
  for (int k = 0; k < 3; ++k) uses.Count("one");
  uses.Record(*catalog_);
  EXPECT_EQ((*catalog_->ListMostUsedFamilies(1))[0].id, "one");  // 4 of 3 and 2
  uses.Count("two");
  uses.Count("two");
  uses.Record(*catalog_);
  EXPECT_EQ((*catalog_->ListMostUsedFamilies(1))[0].id, "two");  // 5
}

}  // namespace
}  // namespace liquidblend::catalog
