#include <sys/resource.h>

#include <csignal>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "core/store/sql/sqlite.h"
#include "tests/core/store/catalog/catalog_suite.h"
#include "tests/core/store/catalog/old_catalogs.h"

namespace liquidblend::store {
namespace {

using Code = absl::StatusCode;

class SqliteBackend : public CatalogBackend {
 public:
  std::unique_ptr<Catalog> Open(const CatalogOptions& options) override {
    auto catalog = OpenSqliteCatalog(folder_.path() + "/catalog.db", options);
    EXPECT_THAT(catalog, Succeeds());
    return catalog.ok() ? *std::move(catalog) : nullptr;
  }

 private:
  TemporaryFolder folder_;
};

INSTANTIATE_TEST_SUITE_P(Sqlite, CatalogSuite,
                         ::testing::Values([]() -> std::unique_ptr<CatalogBackend> {
                           return std::make_unique<SqliteBackend>();
                         }));
INSTANTIATE_TEST_SUITE_P(Sqlite, CatalogVersions,
                         ::testing::Values([]() -> std::unique_ptr<CatalogBackend> {
                           return std::make_unique<SqliteBackend>();
                         }));

class SqliteCatalogTest : public ::testing::Test {
 protected:
  std::unique_ptr<Catalog> MustOpen() {
    auto catalog = OpenSqliteCatalog(path_);
    EXPECT_THAT(catalog, Succeeds());
    return catalog.ok() ? *std::move(catalog) : nullptr;
  }

  static std::string OldRows() {
    return FillOldCatalog([](const std::string& bytes) {
      return absl::StrCat("X'", absl::BytesToHexString(bytes), "'");
    });
  }

  // One connection past the catalog.
  std::unique_ptr<Database> OpenRaw() {
    auto db = Database::Open(path_, absl::Seconds(10));
    EXPECT_THAT(db, Succeeds());
    return db.ok() ? *std::move(db) : nullptr;
  }

  TemporaryFolder folder_;
  std::string path_ = folder_.path() + "/data/catalog.db";
};

TEST_F(SqliteCatalogTest, KeepsEverythingWhenItIsOpenedAgain) {
  const auto job = MustOpen()->SubmitImport(AnimationCalled("a"), ImportOf("a"));
  ASSERT_THAT(job, Succeeds());
  EXPECT_EQ(MustOpen()->GetJob(job->id())->SerializeAsString(), job->SerializeAsString());
}

TEST_F(SqliteCatalogTest, NamesOptionsOutOfRange) {
  CatalogOptions options;
  options.retry.max_attempts = 0;
  EXPECT_THAT(OpenSqliteCatalog(path_, options), Fails(Code::kInvalidArgument, "max_attempts = 0"));
  options = {};
  options.busy_timeout = -absl::Seconds(1);
  EXPECT_THAT(OpenSqliteCatalog(path_, options),
              Fails(Code::kInvalidArgument, "busy_timeout = -1s"));
}

TEST_F(SqliteCatalogTest, MayBeMadeBySeveralProcessesAtOnce) {
  std::vector<pid_t> children;
  for (int child = 0; child < 6; ++child) {
    children.push_back(StartChild([&] {
      const auto catalog = OpenSqliteCatalog(path_);
      if (!catalog.ok()) return 1;
      const std::string id = absl::StrCat("a", child);
      return (*catalog)->SubmitImport(AnimationCalled(id), ImportOf(id)).ok() ? 0 : 2;
    }));
  }
  for (const pid_t child : children) EXPECT_EQ(WaitFor(child), 0);
  EXPECT_EQ(MustOpen()->ListJobs(0, "")->records.size(), 6);
}

TEST_F(SqliteCatalogTest, KnowsItsSchemaVersion) {
  MustOpen();
  int64_t version = 0;
  const auto read = [&](const SqlRow& row) {
    version = row.Int(0);
    return absl::OkStatus();
  };
  EXPECT_THAT(OpenRaw()->Run("PRAGMA user_version", {}, read), Succeeds());
  EXPECT_EQ(version, 7);
  EXPECT_THAT(OpenRaw()->RunScript("PRAGMA user_version = 8"), Succeeds());
  EXPECT_THAT(OpenSqliteCatalog(path_),
              Fails(Code::kFailedPrecondition, path_ + " has schema version 8"));
}

TEST_F(SqliteCatalogTest, BringsOlderDatabasesUpToDate) {
  const std::string third = absl::StrCat(kSqliteVersion2, kSqliteVersion3);
  const std::string fourth = absl::StrCat(third, kSqliteVersion4, kOwnerOfOldJob);
  for (const std::string& later : {std::string(), std::string(kSqliteVersion2), third, fourth}) {
    path_ = absl::StrCat(folder_.path(), "/", later.size(), ".db");
    ASSERT_THAT(OpenRaw()->RunScript(absl::StrCat(kSqliteVersion1, OldRows(), later)), Succeeds());
    absl::Time now;
    CatalogOptions options;
    options.now = [&] { return now; };
    const auto catalog = OpenSqliteCatalog(path_, options);
    ASSERT_THAT(catalog, Succeeds());
    CheckOldRows(**catalog, now, /*with_owners=*/later == fourth);
  }
}

TEST_F(SqliteCatalogTest, KeepsTheVersionsOfADatabaseThatKeptOne) {
  path_ = folder_.path() + "/old.db";
  ASSERT_THAT(OpenRaw()->RunScript(absl::StrCat(kSqliteVersion1, OldRows(), kSqliteVersion2,
                                                kSqliteVersion3, kSqliteVersion4, kSqliteVersion5,
                                                kSqliteVersion6)),
              Succeeds());
  CheckOldVersionIsKept(*MustOpen());
}

TEST_F(SqliteCatalogTest, SeveralProcessesBringADatabaseUpToDateOnce) {
  path_ = folder_.path() + "/old.db";
  ASSERT_THAT(OpenRaw()->RunScript(absl::StrCat(kSqliteVersion1, OldRows())), Succeeds());
  std::vector<pid_t> children;
  for (int child = 0; child < 6; ++child) {
    children.push_back(StartChild([&] {
      const auto catalog = OpenSqliteCatalog(path_);
      if (!catalog.ok()) return 1;
      const std::string id = absl::StrCat("new", child);
      return (*catalog)->SubmitImport(AnimationCalled(id), ImportOf(id)).ok() ? 0 : 2;
    }));
  }
  for (const pid_t child : children) EXPECT_EQ(WaitFor(child), 0);
  EXPECT_EQ(MustOpen()->ListJobs(0, "")->records.size(), 9);
}

// Programs of before know nothing of additions, and their version of the tables is this one's.
TEST_F(SqliteCatalogTest, MakesAdditionsInADatabaseOfAProgramWithoutThem) {
  MustOpen();
  ASSERT_THAT(OpenRaw()->RunScript("DROP TABLE family_uses; DROP TABLE catalog_id; "
                                   "DROP INDEX jobs_queued_by_turn; "
                                   "DROP INDEX jobs_queued_by_due; DROP INDEX jobs_running_by_due; "
                                   "DROP INDEX jobs_unfinished_by_subject"),
              Succeeds());
  EXPECT_THAT(MustOpen()->RecordFamilyUses({}), Succeeds());
  EXPECT_THAT(MustOpen()->Id(), Succeeds());
  EXPECT_THAT(MustOpen()->LeaseJob("one", absl::Minutes(1)), Succeeds());
  EXPECT_THAT(MustOpen()->SubmitImport(AnimationCalled("a"), ImportOf("a")), Succeeds());
  EXPECT_THAT(MustOpen()->DeleteAnimation("a"), Fails(Code::kFailedPrecondition, "is not done"));
  EXPECT_EQ(*QueryInt(*OpenRaw(), "PRAGMA user_version"), SqliteTablesVersion());
}

// A newer program may bring the tables up to date while this one runs.
TEST_F(SqliteCatalogTest, NeitherChangesNorListsNewerTables) {
  const auto catalog = MustOpen();
  const int64_t newer = SqliteTablesVersion() + 1;
  ASSERT_THAT(OpenRaw()->RunScript(absl::StrCat("PRAGMA user_version = ", newer)), Succeeds());
  const auto fails = Fails(Code::kFailedPrecondition, absl::StrCat("has schema version ", newer));
  EXPECT_THAT(catalog->ListReferencedBlobs(), fails);
  EXPECT_THAT(catalog->SubmitImport(AnimationCalled("a"), ImportOf("a")), fails);
}

// A step that cannot be made leaves the former version.
TEST_F(SqliteCatalogTest, LeavesADatabaseThatItCannotBringUpToDate) {
  path_ = folder_.path() + "/old.db";
  ASSERT_THAT(OpenRaw()->RunScript(absl::StrCat(kSqliteVersion1, "DROP TABLE families;",
                                                "CREATE TABLE jobs_to_do (theirs TEXT);")),
              Succeeds());
  EXPECT_FALSE(OpenSqliteCatalog(path_).ok());
  EXPECT_EQ(*QueryInt(*OpenRaw(), "PRAGMA user_version"), 1);
  EXPECT_EQ(*QueryInt(*OpenRaw(), "SELECT COUNT(lease_expires_us) FROM jobs"), 0);
}

TEST_F(SqliteCatalogTest, FindsTheNextJobByAnIndexHoweverLongTheHistory) {
  MustOpen();
  const auto plan = [&](const std::string& statement) {
    std::string text;
    const auto read = [&](const SqlRow& row) {
      absl::StrAppend(&text, row.String(3), "\n");
      return absl::OkStatus();
    };
    EXPECT_THAT(OpenRaw()->Run("EXPLAIN QUERY PLAN " + statement, {}, read), Succeeds());
    return text;
  };
  const std::string next = plan(
      "SELECT record FROM jobs INDEXED BY jobs_queued_by_turn WHERE state = 1 AND (due_us <= 7 OR "
      "due_us > 9) AND memory_bytes <= 5 ORDER BY priority DESC, turn, number LIMIT 1");
  EXPECT_THAT(next, ::testing::HasSubstr("jobs_queued_by_turn"));
  EXPECT_THAT(next, ::testing::Not(::testing::HasSubstr("TEMP B-TREE")));
  EXPECT_THAT(plan("SELECT MIN(due_us) FROM jobs INDEXED BY jobs_running_by_due WHERE state = 2 "
                   "AND memory_bytes <= 5 AND due_us <= 7"),
              ::testing::HasSubstr("jobs_running_by_due (due_us<?)"));
  EXPECT_THAT(plan("SELECT id FROM jobs INDEXED BY jobs_unfinished_by_subject WHERE state IN "
                   "(1, 2, 6) AND parent IS NULL AND subject = 'animations/a'"),
              ::testing::HasSubstr("jobs_unfinished_by_subject (subject=?)"));
  EXPECT_THAT(plan("SELECT * FROM (SELECT number, record FROM jobs WHERE state = 1 AND number > 5 "
                   "ORDER BY number LIMIT 9)"),
              ::testing::HasSubstr("jobs_by_state (state=? AND number>?)"));
  EXPECT_THAT(plan("SELECT parent, record FROM jobs WHERE parent > 'p' ORDER BY parent LIMIT 9"),
              ::testing::HasSubstr("jobs_by_parent (parent>?)"));
  const std::string versions = plan(
      "SELECT family, blob FROM (SELECT id AS family, blob FROM families UNION ALL SELECT family, "
      "blob FROM kept_versions) AS versions WHERE family > 'f' ORDER BY family LIMIT 5");
  EXPECT_THAT(versions, ::testing::Not(::testing::HasSubstr("SCAN")));
  // Lists of records.
  EXPECT_THAT(plan("SELECT id, length(record) FROM animations WHERE id > 'a' ORDER BY id LIMIT 9"),
              ::testing::HasSubstr("(id>?)"));
  EXPECT_THAT(plan("SELECT id, record FROM families WHERE id > 'a' AND id <= 'b' ORDER BY id"),
              ::testing::HasSubstr("(id>? AND id<?)"));
  for (const std::string columns : {"number, length(record)", "number, record"}) {
    const std::string page = plan("SELECT " + columns +
                                  " FROM jobs WHERE parent IS NULL AND number < 9 AND number >= 5 "
                                  "ORDER BY number DESC");
    EXPECT_THAT(page, ::testing::HasSubstr("SEARCH jobs USING"));
    EXPECT_THAT(page, ::testing::Not(::testing::HasSubstr("TEMP B-TREE")));
  }
  EXPECT_THAT(plan("SELECT number, length(record) FROM jobs WHERE ended_us > 5 "
                   "ORDER BY ended_us DESC LIMIT 9"),
              ::testing::HasSubstr("jobs_by_end (ended_us>?)"));
  EXPECT_THAT(plan("SELECT MIN(due_us) FROM jobs INDEXED BY jobs_queued_by_due WHERE state = 1 AND "
                   "due_us > 7 AND memory_bytes <= 5"),
              ::testing::HasSubstr("jobs_queued_by_due (due_us>?)"));
  EXPECT_THAT(plan("SELECT MAX(turn) FROM jobs WHERE priority = 0 AND attempts > 0"),
              ::testing::HasSubstr("jobs_by_turn"));
  EXPECT_THAT(plan("SELECT blob, stored_bytes FROM animations WHERE owner = 'a' AND blob <> ''"),
              ::testing::HasSubstr("COVERING INDEX animations_by_owner"));
  EXPECT_THAT(plan("SELECT MIN(turn) FROM jobs WHERE priority = 0 AND state IN (1, 2)"),
              ::testing::HasSubstr("jobs_to_do"));
  EXPECT_THAT(plan("SELECT number FROM jobs WHERE ended_us < 5 ORDER BY ended_us LIMIT 7"),
              ::testing::HasSubstr("jobs_by_end"));
  EXPECT_THAT(plan("SELECT MAX(turn) FROM jobs WHERE owner = 'a' AND priority = 0 AND state IN (1, "
                   "2, 6)"),
              ::testing::HasSubstr("jobs_by_owner"));
}

TEST_F(SqliteCatalogTest, LeavesOtherDatabasesAlone) {
  MustOpen();
  EXPECT_THAT(OpenRaw()->RunScript("PRAGMA application_id = 7"), Succeeds());
  EXPECT_THAT(OpenSqliteCatalog(path_),
              Fails(Code::kFailedPrecondition, path_ + " is not a liquidblend catalog"));
  path_ = folder_.path() + "/other.db";
  EXPECT_THAT(OpenRaw()->RunScript("CREATE TABLE theirs (a INTEGER)"), Succeeds());
  EXPECT_THAT(OpenSqliteCatalog(path_),
              Fails(Code::kFailedPrecondition, path_ + " is not a liquidblend catalog"));
}

TEST_F(SqliteCatalogTest, NamesALockedDatabase) {
  CatalogOptions options;
  options.busy_timeout = absl::ZeroDuration();
  const auto catalog = OpenSqliteCatalog(path_, options);
  ASSERT_THAT(catalog, Succeeds());
  const auto holder = OpenRaw();
  EXPECT_THAT(holder->Transaction([&] {
    EXPECT_THAT((*catalog)->SubmitImport(AnimationCalled("a"), ImportOf("a")),
                Fails(Code::kUnavailable, path_));
    EXPECT_THAT((*catalog)->GetAnimation("a"), Fails(Code::kNotFound, "'a'"));  // reads go on
    return absl::OkStatus();
  }),
              Succeeds());
  EXPECT_THAT((*catalog)->SubmitImport(AnimationCalled("a"), ImportOf("a")), Succeeds());
}

TEST_F(SqliteCatalogTest, NamesTheDatabaseThatCannotGrow) {
  MustOpen();
  const int status = RunChild([&] {
    signal(SIGXFSZ, SIG_IGN);
    const auto catalog = OpenSqliteCatalog(path_);
    if (!catalog.ok()) return 1;
    const rlimit limit = {4096, 4096};
    setrlimit(RLIMIT_FSIZE, &limit);
    const auto full = (*catalog)->SubmitImport(AnimationCalled("a"), ImportOf("a")).status();
    if (!absl::IsResourceExhausted(full) || !absl::StrContains(full.message(), path_)) return 2;
    return absl::IsNotFound((*catalog)->GetAnimation("a").status()) ? 0 : 3;
  });
  EXPECT_EQ(status, 0);
  EXPECT_THAT(MustOpen()->SubmitImport(AnimationCalled("a"), ImportOf("a")), Succeeds());
}

TEST_F(SqliteCatalogTest, NamesADamagedDatabase) {
  ASSERT_THAT(MustOpen()->SubmitImport(AnimationCalled("a"), ImportOf("a")), Succeeds());
  const std::string whole = ReadFile(path_);
  ASSERT_GT(whole.size(), 8192u);
  WriteFile(path_, SampleBytes(whole.size()));
  EXPECT_THAT(OpenSqliteCatalog(path_), Fails(Code::kDataLoss, path_));
  WriteFile(path_, whole.substr(0, 4096) + SampleBytes(whole.size() - 4096));
  EXPECT_THAT(OpenSqliteCatalog(path_), Fails(Code::kDataLoss, path_));
  WriteFile(path_, whole.substr(0, whole.size() / 2));
  EXPECT_THAT(OpenSqliteCatalog(path_), Fails(Code::kDataLoss, path_));
  WriteFile(path_, whole);
  EXPECT_THAT(MustOpen()->GetAnimation("a"), Succeeds());
}

TEST_F(SqliteCatalogTest, NamesARecordThatCannotBeRead) {
  const auto catalog = MustOpen();
  ASSERT_THAT(catalog->SubmitImport(AnimationCalled("a"), ImportOf("a")), Succeeds());
  EXPECT_THAT(OpenRaw()->RunScript("UPDATE animations SET record = X'FFFF'"), Succeeds());
  EXPECT_THAT(catalog->GetAnimation("a"),
              Fails(Code::kDataLoss, path_ + ": the record of animation 'a'"));
  EXPECT_THAT(catalog->ListAnimations(0, ""), Fails(Code::kDataLoss, path_));
}

// ---- killed in the middle

TEST_F(SqliteCatalogTest, HasNothingOfAChangeKilledBeforeItsCommit) {
  MustOpen();
  EXPECT_TRUE(DiesAt("catalog.before_commit", [&] {
    const auto catalog = OpenSqliteCatalog(path_);
    if (catalog.ok()) (*catalog)->SubmitImport(AnimationCalled("a"), ImportOf("a")).IgnoreError();
  }));
  EXPECT_TRUE(MustOpen()->ListAnimations(0, "")->records.empty());
  EXPECT_TRUE(MustOpen()->ListJobs(0, "")->records.empty());
}

TEST_F(SqliteCatalogTest, HasAllOfAChangeKilledAfterItsCommit) {
  EXPECT_TRUE(DiesAt("catalog.after_commit", [&] {
    const auto catalog = OpenSqliteCatalog(path_);
    if (!catalog.ok()) return;
    (*catalog)->SubmitImport(AnimationCalled("a"), ImportOf("a", "request")).IgnoreError();
  }));
  const auto catalog = MustOpen();
  EXPECT_THAT(catalog->GetAnimation("a"), Succeeds());
  EXPECT_EQ(catalog->ListJobs(0, "")->records.size(), 1);
  // Whoever asked may ask again.
  EXPECT_THAT(catalog->SubmitImport(AnimationCalled("a"), ImportOf("a", "request")), Succeeds());
  EXPECT_EQ(catalog->ListJobs(0, "")->records.size(), 1);
}

TEST_F(SqliteCatalogTest, AnotherWorkerFinishesAJobWhosePublicationWasKilled) {
  const auto job = MustOpen()->SubmitImport(AnimationCalled("a"), ImportOf("a"));
  ASSERT_THAT(job, Succeeds());
  EXPECT_TRUE(DiesAt("publish.before_commit", [&] {
    const auto catalog = OpenSqliteCatalog(path_);
    if (!catalog.ok()) return;
    const auto lease = (*catalog)->LeaseJob("victim", absl::Minutes(1));
    if (!lease.ok() || !lease->has_value()) return;
    (*catalog)->PublishAnimation((*lease)->lease_id, AnimationCalled("a")).IgnoreError();
  }));
  EXPECT_EQ(MustOpen()->GetAnimation("a")->state(), pb::AnimationRecord::IMPORTING);
  EXPECT_EQ(MustOpen()->GetJob(job->id())->state(), pb::JobRecord::RUNNING);
  CatalogOptions later;
  later.now = [] { return absl::Now() + absl::Minutes(2); };
  const auto catalog = OpenSqliteCatalog(path_, later);
  ASSERT_THAT(catalog, Succeeds());
  const auto lease = (*catalog)->LeaseJob("other", absl::Minutes(1));
  ASSERT_THAT(lease, Succeeds());
  ASSERT_TRUE(lease->has_value());
  EXPECT_EQ((*lease)->job.attempts(), 2);
  EXPECT_THAT((*catalog)->PublishAnimation((*lease)->lease_id, AnimationCalled("a")), Succeeds());
  EXPECT_EQ(MustOpen()->GetAnimation("a")->state(), pb::AnimationRecord::READY);
}

// The last child's end and what follows from it are one change.
TEST_F(SqliteCatalogTest, ARegistrationIsQueuedWithItsLastChildOrNotAtAll) {
  {
    const auto catalog = MustOpen();
    for (const char* id : {"a", "b"}) {
      ASSERT_THAT(catalog->SubmitImport(AnimationCalled(id), ImportOf(id)), Succeeds());
      const auto lease = catalog->LeaseJob("worker", absl::Minutes(1));
      ASSERT_THAT(catalog->PublishAnimation((*lease)->lease_id, AnimationCalled(id)), Succeeds());
    }
    ASSERT_THAT(catalog->SubmitRegistration(RegistrationOf("f", "a", {"a", "b"})), Succeeds());
    const auto lease = catalog->LeaseJob("worker", absl::Minutes(1));
    ASSERT_THAT(catalog->FinishChild((*lease)->lease_id, "blob"), Succeeds());
  }
  const auto finish_last = [&](absl::Duration later) {
    CatalogOptions options;
    options.now = [=] { return absl::Now() + later; };
    const auto catalog = OpenSqliteCatalog(path_, options);
    if (!catalog.ok()) return;
    const auto lease = (*catalog)->LeaseJob("victim", absl::Minutes(1));
    if (!lease.ok() || !lease->has_value()) return;
    (*catalog)->FinishChild((*lease)->lease_id, "blob").IgnoreError();
  };
  const auto state = [&] { return MustOpen()->ListJobs(1, "")->records[0].state(); };
  EXPECT_TRUE(DiesAt("publish.before_commit", [&] { finish_last(absl::ZeroDuration()); }));
  EXPECT_EQ(state(), pb::JobRecord::WAITING);
  EXPECT_TRUE(DiesAt("publish.after_commit", [&] { finish_last(absl::Minutes(2)); }));
  EXPECT_EQ(state(), pb::JobRecord::QUEUED);
}

TEST_F(SqliteCatalogTest, HasAPublicationKilledAfterItsCommit) {
  const auto job = MustOpen()->SubmitImport(AnimationCalled("a"), ImportOf("a"));
  ASSERT_THAT(job, Succeeds());
  EXPECT_TRUE(DiesAt("publish.after_commit", [&] {
    const auto catalog = OpenSqliteCatalog(path_);
    if (!catalog.ok()) return;
    const auto lease = (*catalog)->LeaseJob("victim", absl::Minutes(1));
    if (!lease.ok() || !lease->has_value()) return;
    (*catalog)->PublishAnimation((*lease)->lease_id, AnimationCalled("a")).IgnoreError();
  }));
  EXPECT_EQ(MustOpen()->GetAnimation("a")->state(), pb::AnimationRecord::READY);
  EXPECT_EQ(MustOpen()->GetJob(job->id())->state(), pb::JobRecord::SUCCEEDED);
}

}  // namespace
}  // namespace liquidblend::store
