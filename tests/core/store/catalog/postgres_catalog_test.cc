#include <algorithm>
#include <atomic>
#include <optional>
#include <thread>

#include "absl/strings/escaping.h"
#include "absl/synchronization/barrier.h"
#include "absl/time/clock.h"
#include "core/base/retry.h"
#include "core/store/sql/postgres.h"
#include "tests/core/store/catalog/catalog_suite.h"
#include "tests/core/store/catalog/old_catalogs.h"
#include "tests/core/store/sql/postgres_server.h"

namespace liquidblend::store {
namespace {

using Code = absl::StatusCode;

// As ChangeShared() takes them.
constexpr char kLocksOfAPublication[] =
    "SELECT pg_advisory_xact_lock_shared(1280393805, 'catalog_version'::regclass::oid::int); "
    "SELECT version FROM catalog_version FOR SHARE";
constexpr char kOthersHoldTheLock[] = "other changes have held the catalog's lock for 2s";

class PostgresBackend : public CatalogBackend {
 public:
  std::unique_ptr<Catalog> Open(const CatalogOptions& options) override {
    auto catalog = OpenPostgresCatalog(url_, options);
    EXPECT_THAT(catalog, Succeeds());
    return catalog.ok() ? *std::move(catalog) : nullptr;
  }

 private:
  const std::string url_ = SharedPostgresServer().NewUrl();
};

INSTANTIATE_TEST_SUITE_P(Postgres, CatalogSuite,
                         ::testing::Values([]() -> std::unique_ptr<CatalogBackend> {
                           return std::make_unique<PostgresBackend>();
                         }));
INSTANTIATE_TEST_SUITE_P(Postgres, CatalogVersions,
                         ::testing::Values([]() -> std::unique_ptr<CatalogBackend> {
                           return std::make_unique<PostgresBackend>();
                         }));

class PostgresCatalogTest : public ::testing::Test {
 protected:
  std::unique_ptr<Catalog> MustOpen(const CatalogOptions& options = {}) {
    auto catalog = OpenPostgresCatalog(url_, options);
    EXPECT_THAT(catalog, Succeeds());
    return catalog.ok() ? *std::move(catalog) : nullptr;
  }

  std::string Run(const std::string& script) { return server_.Run(url_, script); }

  // Lists the blobs again and again while another connection runs the script.
  void ListWhile(const std::string& script, const std::vector<std::string>& expected) {
    const auto catalog = MustOpen();
    std::atomic<bool> is_done = false;
    std::atomic<int> num_runs = 0;
    std::thread other([&] {
      const auto connection = OpenConnection();
      for (; !is_done; ++num_runs) EXPECT_THAT(connection->RunScript(script), Succeeds());
    });
    const absl::Time give_up = absl::Now() + absl::Minutes(1);
    for (int k = 0; k < 300 || (num_runs <= 10 && absl::Now() < give_up); ++k) {
      const auto blobs = catalog->ListReferencedBlobs();
      EXPECT_THAT(blobs, Succeeds());
      EXPECT_EQ(blobs.value_or(std::vector<std::string>()), expected);
    }
    is_done = true;
    other.join();
    EXPECT_GT(num_runs, 10);
  }

  // A catalog that does not wait for long.
  std::unique_ptr<Catalog> MustOpenHasty() {
    EXPECT_NE(MustOpen(), nullptr);  // makes the tables, which may take longer
    CatalogOptions options;
    options.busy_timeout = absl::Seconds(2);
    return MustOpen(options);
  }

  // The url of the catalog for a new user, who may do all in its schema but owns nothing.
  std::string UrlOfNewRole(const std::string& role, const std::string& schema) {
    Run("CREATE ROLE " + role);
    for (const std::string what :
         {"SCHEMA ", "ALL TABLES IN SCHEMA ", "ALL SEQUENCES IN SCHEMA "}) {
      Run(absl::StrCat("GRANT ALL ON ", what, schema, " TO ", role));
    }
    return absl::StrCat(url_, "%20-crole%3D", role);
  }

  static std::string OldRows() {
    return FillOldCatalog([](const std::string& bytes) {
      return absl::StrCat("'\\x", absl::BytesToHexString(bytes), "'");
    });
  }

  // Without values, as many statements as one likes.
  void RunScript(const std::string& script) {
    EXPECT_THAT(OpenConnection()->RunScript(script), Succeeds());
  }

  std::unique_ptr<PostgresConnection> OpenConnection() {
    auto connection =
        PostgresConnection::Open(*ParsePostgresUrl(url_, absl::Seconds(10)), PostgresOptions());
    EXPECT_THAT(connection, Succeeds());
    return connection.ok() ? *std::move(connection) : nullptr;
  }

  // Returns when so many statements wait for locks.
  void AwaitWaiting(int num) {
    const auto is_waiting = [&] {
      return Run("SELECT count(*) FROM pg_stat_activity WHERE wait_event_type = 'Lock'") ==
             absl::StrCat(num);
    };
    for (int k = 0; k < 400 && !is_waiting(); ++k) absl::SleepFor(absl::Milliseconds(10));
    EXPECT_TRUE(is_waiting());
  }

  // What FillOldCatalog() has put there.
  void CheckIsBroughtUpToDate(bool with_owners = false) {
    absl::Time now;
    CatalogOptions options;
    options.now = [&] { return now; };
    const auto catalog = MustOpen(options);
    ASSERT_NE(catalog, nullptr);
    EXPECT_EQ(Run("SELECT version FROM catalog_version"), "6");
    CheckOldRows(*catalog, now, with_owners);
  }

  PostgresServer& server_ = SharedPostgresServer();
  const std::string url_ = server_.NewUrl();
};

TEST_F(PostgresCatalogTest, KeepsEverythingWhenItIsOpenedAgain) {
  const auto job = MustOpen()->SubmitImport(AnimationCalled("a"), ImportOf("a"));
  ASSERT_THAT(job, Succeeds());
  EXPECT_EQ(MustOpen()->GetJob(job->id())->SerializeAsString(), job->SerializeAsString());
}

TEST_F(PostgresCatalogTest, NamesOptionsOutOfRange) {
  CatalogOptions options;
  options.max_connections = 0;
  EXPECT_THAT(OpenPostgresCatalog(url_, options),
              Fails(Code::kInvalidArgument, "max_connections = 0"));
}

TEST_F(PostgresCatalogTest, DoesNotShowAUrlThatItCannotRead) {
  for (const std::string url : {"", "catalog.sqlite", "postgresql://user:secret@host:port:/%zz",
                                "postgresql://user:secret@host/db?unknown=1", "mysql://secret"}) {
    const absl::Status status = OpenPostgresCatalog(url).status();
    EXPECT_THAT(status, Fails(Code::kInvalidArgument, "postgresql://user@host:port/database"));
    EXPECT_THAT(std::string(status.message()), ::testing::Not(::testing::HasSubstr("secret")));
  }
}

TEST_F(PostgresCatalogTest, NamesADatabaseThatIsNotThereWithoutItsPassword) {
  const absl::Status status =
      OpenPostgresCatalog("postgresql://user:secret@127.0.0.1:1/db?password=secret").status();
  EXPECT_THAT(status, Fails(Code::kUnavailable, "database postgresql://user@127.0.0.1:1/db"));
  EXPECT_THAT(std::string(status.message()), ::testing::Not(::testing::HasSubstr("secret")));
}

TEST_F(PostgresCatalogTest, MayBeMadeBySeveralProcessesAtOnce) {
  std::vector<pid_t> children;
  for (int child = 0; child < 6; ++child) {
    children.push_back(StartChild([&] {
      const auto catalog = OpenPostgresCatalog(url_);
      if (!catalog.ok()) return 1;
      const std::string id = absl::StrCat("a", child);
      return (*catalog)->SubmitImport(AnimationCalled(id), ImportOf(id)).ok() ? 0 : 2;
    }));
  }
  for (const pid_t child : children) EXPECT_EQ(WaitFor(child), 0);
  EXPECT_EQ(MustOpen()->ListJobs(0, "")->records.size(), 6);
}

TEST_F(PostgresCatalogTest, BringsAnOlderDatabaseUpToDate) {
  RunScript(absl::StrCat(kPostgresVersion1, OldRows()));
  CheckIsBroughtUpToDate();
}

TEST_F(PostgresCatalogTest, BringsTheSecondVersionUpToDate) {
  RunScript(absl::StrCat(kPostgresVersion1, OldRows(), kPostgresVersion2));
  CheckIsBroughtUpToDate();
}

TEST_F(PostgresCatalogTest, BringsTheVersionWithoutOwnersUpToDate) {
  RunScript(absl::StrCat(kPostgresVersion1, OldRows(), kPostgresVersion2, kPostgresVersion3,
                         kOwnerOfOldJob));
  CheckIsBroughtUpToDate(/*with_owners=*/true);
}

TEST_F(PostgresCatalogTest, KeepsTheVersionsOfADatabaseThatKeptOne) {
  RunScript(absl::StrCat(kPostgresVersion1, OldRows(), kPostgresVersion2, kPostgresVersion3,
                         kPostgresVersion4, kPostgresVersion5));
  CheckOldVersionIsKept(*MustOpen());
}

TEST_F(PostgresCatalogTest, SeveralProcessesBringADatabaseUpToDateOnce) {
  RunScript(absl::StrCat(kPostgresVersion1, OldRows()));
  std::vector<pid_t> children;
  for (int child = 0; child < 6; ++child) {
    children.push_back(StartChild([&] {
      const auto catalog = OpenPostgresCatalog(url_);
      if (!catalog.ok()) return 1;
      const std::string id = absl::StrCat("new", child);
      return (*catalog)->SubmitImport(AnimationCalled(id), ImportOf(id)).ok() ? 0 : 2;
    }));
  }
  for (const pid_t child : children) EXPECT_EQ(WaitFor(child), 0);
  EXPECT_EQ(MustOpen()->ListJobs(0, "")->records.size(), 9);
  EXPECT_EQ(Run("SELECT version FROM catalog_version"), "6");
}

// A step that cannot be made leaves the former version.
TEST_F(PostgresCatalogTest, LeavesADatabaseThatItCannotBringUpToDate) {
  RunScript(absl::StrCat(kPostgresVersion1, "ALTER TABLE jobs DROP COLUMN lease_expires_us;"));
  EXPECT_THAT(OpenPostgresCatalog(url_), Fails(Code::kInternal, "lease_expires_us"));
  EXPECT_EQ(Run("SELECT version FROM catalog_version"), "1");
}

// A program of the former version that is still there is told so, and spoils nothing.
TEST_F(PostgresCatalogTest, StatementsOfTheFormerVersionFail) {
  MustOpen();
  const auto target = ParsePostgresUrl(url_, absl::Seconds(10));
  const auto old = PostgresConnection::Open(*target, PostgresOptions());
  ASSERT_THAT(old, Succeeds());
  EXPECT_THAT((*old)->Run("SELECT record, lease_id, lease_expires_us FROM jobs"),
              Fails(Code::kInternal, "lease_expires_us"));
}

TEST_F(PostgresCatalogTest, RefusesTheCatalogOfANewerProgram) {
  const auto catalog = MustOpen();
  for (const char* id : {"b", "c"}) {
    ASSERT_THAT(catalog->SubmitImport(AnimationCalled(id), ImportOf(id)), Succeeds());
  }
  const auto lease = catalog->LeaseJob("worker", absl::Minutes(1));
  ASSERT_TRUE(lease.ok() && lease->has_value());
  EXPECT_EQ(Run("SELECT version FROM catalog_version"), "6");
  Run("UPDATE catalog_version SET version = 7");
  EXPECT_THAT(OpenPostgresCatalog(url_),
              Fails(Code::kFailedPrecondition, "has schema version 7; this program knows 1 to 6"));
  // One that was open already neither changes anything nor lists blobs any more.
  EXPECT_THAT(catalog->ListReferencedBlobs(),
              Fails(Code::kFailedPrecondition, "has schema version 7"));
  EXPECT_THAT(catalog->SubmitImport(AnimationCalled("a"), ImportOf("a")),
              Fails(Code::kFailedPrecondition, "has schema version 7"));
  // A worker neither takes a job, whose result would be refused, nor keeps one.
  EXPECT_THAT(catalog->LeaseJob("worker", absl::Minutes(1)),
              Fails(Code::kFailedPrecondition, "has schema version 7"));
  EXPECT_THAT(catalog->Heartbeat((*lease)->lease_id, absl::Minutes(1), {}),
              Fails(Code::kFailedPrecondition, "has schema version 7"));
  EXPECT_THAT(catalog->SaveCheckpoint((*lease)->lease_id, "blob"),
              Fails(Code::kFailedPrecondition, "has schema version 7"));
  EXPECT_EQ(Run("SELECT string_agg(state::text, ' ' ORDER BY number) FROM jobs"), "2 1");
}

// Programs of before know nothing of additions, and their version of the tables is this one's.
TEST_F(PostgresCatalogTest, MakesAdditionsInADatabaseOfAProgramWithoutThem) {
  const auto old = MustOpen();
  Run("DROP TABLE family_uses");
  Run("DROP TABLE catalog_id");
  EXPECT_THAT(old->Id(), Fails(Code::kFailedPrecondition, "has no id"));
  EXPECT_THAT(MustOpen()->RecordFamilyUses({}), Succeeds());
  EXPECT_THAT(old->Id(), Succeeds());
  for (const std::string index : {"jobs_queued_by_turn", "jobs_queued_by_due",
                                  "jobs_running_by_due", "jobs_unfinished_by_subject"}) {
    Run("DROP INDEX " + index);
    MustOpen();
    EXPECT_EQ(Run("SELECT count(*) FROM pg_class WHERE relnamespace = "
                  "current_schema()::text::regnamespace AND relname = '" +
                  index + "'"),
              "1");
  }
  EXPECT_THAT(old->SubmitImport(AnimationCalled("a"), ImportOf("a")), Succeeds());
}

TEST_F(PostgresCatalogTest, LeavesOtherDatabasesAlone) {
  Run("CREATE TABLE jobs (theirs TEXT)");
  EXPECT_THAT(OpenPostgresCatalog(url_),
              Fails(Code::kFailedPrecondition, "is not a liquidblend catalog"));
  EXPECT_EQ(Run("SELECT count(*) FROM pg_tables WHERE schemaname = current_schema()"), "1");
}

TEST_F(PostgresCatalogTest, FindsTheNextJobByAnIndexHoweverLongTheHistory) {
  MustOpen();
  Run("INSERT INTO jobs (id, state, subject, record) "
      "SELECT 'job-' || k, 3, 'animations/a', '' FROM generate_series(1, 20000) AS k");
  Run("INSERT INTO jobs (id, state, subject, due_us, record) "
      "SELECT 'job-' || k, 1 + k % 2, 'animations/a', k % 2 * k, '' "
      "FROM generate_series(20001, 24000) AS k");
  Run("ANALYZE jobs");
  const std::string plan =
      Run("EXPLAIN (FORMAT JSON) SELECT record FROM jobs WHERE state = 1 AND (due_us <= 7 OR "
          "due_us > 9) AND memory_bytes <= 5 ORDER BY priority DESC, turn, number LIMIT 1");
  EXPECT_THAT(plan, ::testing::HasSubstr("jobs_queued_by_turn"));
  EXPECT_THAT(plan, ::testing::Not(::testing::HasSubstr("Sort")));
  const std::string lost =
      Run("EXPLAIN (FORMAT JSON) SELECT COALESCE("
          "(SELECT MIN(due_us) FROM jobs WHERE state = 2 AND memory_bytes <= 5 AND due_us <= 7), "
          "(SELECT MAX(due_us) FROM jobs WHERE state = 2 AND memory_bytes <= 5 AND due_us > 9))");
  EXPECT_THAT(lost, ::testing::HasSubstr("jobs_running_by_due"));
  EXPECT_THAT(lost, ::testing::HasSubstr("due_us <= 7"));
  EXPECT_THAT(lost, ::testing::Not(::testing::HasSubstr("Seq Scan")));
  EXPECT_THAT(Run("EXPLAIN (FORMAT JSON) SELECT MIN(due_us) FROM jobs WHERE state = 1 AND "
                  "due_us > 7 AND memory_bytes <= 5"),
              ::testing::HasSubstr("jobs_queued_by_due"));
  EXPECT_THAT(Run("EXPLAIN (FORMAT JSON) SELECT MAX(turn) FROM jobs WHERE priority = 0 AND "
                  "attempts > 0"),
              ::testing::HasSubstr("jobs_by_turn"));
  EXPECT_THAT(Run("EXPLAIN (FORMAT JSON) SELECT MAX(turn) FROM jobs WHERE owner = 'a' AND "
                  "priority = 0 AND state IN (1, 2, 6)"),
              ::testing::HasSubstr("jobs_by_owner"));
  EXPECT_THAT(Run("EXPLAIN (FORMAT JSON) SELECT id FROM jobs WHERE state IN (1, 2, 6) AND subject "
                  "= 'animations/b' AND parent IS NULL"),
              ::testing::HasSubstr("jobs_unfinished_by_subject"));
}

TEST_F(PostgresCatalogTest, RefusesTextWithAZeroByte) {
  const std::string id("a\0b", 3);
  EXPECT_THAT(MustOpen()->GetAnimation(id), Fails(Code::kInvalidArgument, "zero byte"));
}

TEST_F(PostgresCatalogTest, NamesARecordThatCannotBeRead) {
  const auto catalog = MustOpen();
  ASSERT_THAT(catalog->SubmitImport(AnimationCalled("a"), ImportOf("a")), Succeeds());
  Run("UPDATE animations SET record = '\\xffff'");
  EXPECT_THAT(catalog->GetAnimation("a"), Fails(Code::kDataLoss, "the record of animation 'a'"));
}

// ---- time

TEST_F(PostgresCatalogTest, LeasesRunByTheClockOfTheDatabase) {
  const auto catalog = MustOpen();
  const auto job = catalog->SubmitImport(AnimationCalled("a"), ImportOf("a"));
  ASSERT_THAT(job, Succeeds());
  EXPECT_LT(std::abs(job->create_time().seconds() - absl::ToUnixSeconds(absl::Now())), 5);
  ASSERT_TRUE((*catalog->LeaseJob("one", absl::Minutes(1))).has_value());
  EXPECT_FALSE((*catalog->LeaseJob("two", absl::Minutes(1))).has_value());
  Run("UPDATE jobs SET due_us = due_us - 61000000");
  EXPECT_TRUE((*catalog->LeaseJob("two", absl::Minutes(1))).has_value());
}

// ---- waiting for work

TEST_F(PostgresCatalogTest, HearsOfAJobAtOnce) {
  const auto worker = MustOpen(), server = MustOpen();
  const auto idle = worker->WaitForJob(absl::Milliseconds(1));
  ASSERT_THAT(idle, Succeeds());
  EXPECT_FALSE(*idle);
  std::thread thread(
      [&] { EXPECT_THAT(server->SubmitImport(AnimationCalled("a"), ImportOf("a")), Succeeds()); });
  const auto woken = worker->WaitForJob(absl::Seconds(30));
  thread.join();
  ASSERT_THAT(woken, Succeeds());
  EXPECT_TRUE(*woken);
}

// ---- several at once

// Each of 8 rounds, both children wait for their parent's row; each time exactly one of them queues
// it.
TEST_F(PostgresCatalogTest, TwoChildrenThatEndAtOnceQueueTheirRegistrationOnce) {
  const auto catalog = MustOpen();
  for (const char* id : {"a", "b"}) {
    ASSERT_THAT(catalog->SubmitImport(AnimationCalled(id), ImportOf(id)), Succeeds());
    const auto lease = catalog->LeaseJob("worker", absl::Minutes(1));
    ASSERT_THAT(catalog->PublishAnimation((*lease)->lease_id, AnimationCalled(id)), Succeeds());
  }
  for (int round = 0; round < 8; ++round) {
    const std::string family = absl::StrCat("f", round);
    ASSERT_THAT(catalog->SubmitRegistration(RegistrationOf(family, "a", {"a", "b"})), Succeeds());
    std::vector<std::string> leases;
    for (int k = 0; k < 2; ++k) {
      const auto lease = catalog->LeaseJob("worker", absl::Minutes(1));
      ASSERT_TRUE(lease.ok() && lease->has_value());
      leases.push_back((*lease)->lease_id);
    }
    std::vector<std::thread> threads;
    const auto holder = OpenConnection();
    EXPECT_THAT(holder->Transaction([&] {
      EXPECT_THAT(holder->Run("SELECT FROM jobs WHERE state = 6 FOR UPDATE"), Succeeds());
      for (const std::string& id : leases) {
        threads.emplace_back(
            [&catalog, id] { EXPECT_THAT(catalog->FinishChild(id, "blob"), Succeeds()); });
      }
      AwaitWaiting(2);
      return absl::OkStatus();
    }),
                Succeeds());
    for (std::thread& thread : threads) thread.join();
    const auto whole = catalog->LeaseJob("worker", absl::Minutes(1));
    ASSERT_TRUE(whole.ok() && whole->has_value());
    EXPECT_TRUE((*whole)->job.has_register_family());
    EXPECT_FALSE((*catalog->LeaseJob("worker", absl::Minutes(1))).has_value());
    pb::FamilyRecord record;
    record.set_id(family);
    EXPECT_THAT(catalog->PublishFamily((*whole)->lease_id, record), Succeeds());
  }
}

TEST_F(PostgresCatalogTest, AWorkerPassesOverAJobThatAnotherIsTaking) {
  const auto catalog = MustOpen();
  for (const char* id : {"a", "b"}) {
    ASSERT_THAT(catalog->SubmitImport(AnimationCalled(id), ImportOf(id)), Succeeds());
  }
  const auto other = OpenConnection();
  EXPECT_THAT(other->Transaction([&] {
    EXPECT_THAT(other->Run("SELECT 1 FROM jobs ORDER BY number LIMIT 1 FOR UPDATE"), Succeeds());
    const auto lease = catalog->LeaseJob("worker", absl::Minutes(1));
    EXPECT_EQ((*lease)->job.import_animation().animation(), "b");
    return absl::OkStatus();
  }),
              Succeeds());
}

TEST_F(PostgresCatalogTest, GivesUpWaitingForWhoeverHoldsALock) {
  const auto catalog = MustOpenHasty();
  const auto other = OpenConnection();
  EXPECT_THAT(other->Transaction([&] {
    EXPECT_THAT(other->Run("SELECT 1 FROM catalog_version FOR UPDATE"), Succeeds());
    EXPECT_THAT(catalog->SubmitImport(AnimationCalled("a"), ImportOf("a")),
                Fails(Code::kUnavailable, kOthersHoldTheLock));
    EXPECT_THAT(catalog->GetAnimation("a"), Fails(Code::kNotFound, "'a'"));  // reads go on
    return absl::OkStatus();
  }),
              Succeeds());
  EXPECT_THAT(catalog->SubmitImport(AnimationCalled("a"), ImportOf("a")), Succeeds());
}

// After a statement that failed, PostgreSQL refuses all others of the transaction. The caller must
// get the first error: it says that the same call may succeed later.
TEST_F(PostgresCatalogTest, ARegistrationThatCannotLookForItsFamilyEndsAtOnce) {
  const auto catalog = MustOpenHasty();
  const auto other = OpenConnection();
  EXPECT_THAT(other->Transaction([&] {
    EXPECT_THAT(other->Run("LOCK TABLE families IN ACCESS EXCLUSIVE MODE"), Succeeds());
    EXPECT_THAT(catalog->SubmitRegistration(RegistrationOf("f", "a", {"b"})),
                Fails(Code::kUnavailable, "timeout"));
    return absl::OkStatus();
  }),
              Succeeds());
}

TEST_F(PostgresCatalogTest, WorkersPublishBesideEachOther) {
  const auto catalog = MustOpen();
  const auto hasty = MustOpenHasty();
  std::vector<std::string> leases;
  for (const std::string id : {"a", "b"}) {
    ASSERT_THAT(catalog->SubmitImport(AnimationCalled(id), ImportOf(id)), Succeeds());
    const auto lease = catalog->LeaseJob("worker", absl::Minutes(1));
    ASSERT_TRUE(lease.ok() && lease->has_value());
    leases.push_back((*lease)->lease_id);
  }
  const auto other = OpenConnection();
  EXPECT_THAT(other->Transaction([&] {
    EXPECT_THAT(other->RunScript(kLocksOfAPublication), Succeeds());
    EXPECT_THAT(catalog->PublishAnimation(leases[0], AnimationCalled("a")), Succeeds());
    EXPECT_THAT(hasty->SubmitImport(AnimationCalled("c"), ImportOf("c")),
                Fails(Code::kUnavailable, kOthersHoldTheLock));
    return absl::OkStatus();
  }),
              Succeeds());
  EXPECT_THAT(other->Transaction([&] {  // a change by a program of 0.2.0
    EXPECT_THAT(other->Run("SELECT version FROM catalog_version FOR UPDATE"), Succeeds());
    EXPECT_THAT(hasty->PublishAnimation(leases[1], AnimationCalled("b")),
                Fails(Code::kUnavailable, kOthersHoldTheLock));
    EXPECT_THAT(catalog->ListReferencedBlobs(), Succeeds());  // waits for nobody
    return absl::OkStatus();
  }),
              Succeeds());
  EXPECT_THAT(catalog->PublishAnimation(leases[1], AnimationCalled("b")), Succeeds());
}

// Many workers may be stopped at once, and each has three seconds.
TEST_F(PostgresCatalogTest, AWorkerGivesItsJobBackBesideOtherChanges) {
  const auto catalog = MustOpen();
  const auto hasty = MustOpenHasty();
  std::vector<Lease> leases;
  for (const std::string id : {"a", "b"}) {
    ASSERT_THAT(catalog->SubmitImport(AnimationCalled(id), ImportOf(id)), Succeeds());
    const auto lease = catalog->LeaseJob("worker", absl::Minutes(1));
    ASSERT_TRUE(lease.ok() && lease->has_value());
    leases.push_back(**lease);
  }
  ASSERT_THAT(catalog->RequestCancel(leases[1].job.id()), Succeeds());
  const auto other = OpenConnection();
  EXPECT_THAT(other->Transaction([&] {
    EXPECT_THAT(other->Run("SELECT 1 FROM catalog_version FOR UPDATE"), Succeeds());
    EXPECT_THAT(catalog->ReleaseJob(leases[0].lease_id), Succeeds());
    // The end of a cancelled job changes more than its row.
    EXPECT_THAT(hasty->ReleaseJob(leases[1].lease_id),
                Fails(Code::kUnavailable, kOthersHoldTheLock));
    return absl::OkStatus();
  }),
              Succeeds());
  EXPECT_EQ(catalog->GetJob(leases[0].job.id())->state(), pb::JobRecord::QUEUED);
  EXPECT_THAT(catalog->ReleaseJob(leases[1].lease_id), Succeeds());
  EXPECT_EQ(catalog->GetJob(leases[1].job.id())->state(), pb::JobRecord::CANCELLED);
  EXPECT_EQ(catalog->GetAnimation("b")->state(), pb::AnimationRecord::FAILED);
}

// A change that has to wait gives its connection back for a moment, and takes its turn again.
TEST_F(PostgresCatalogTest, AChangeOutlastsOneThatTakesLong) {
  CatalogOptions options;
  options.max_connections = 1;
  const auto catalog = MustOpen(options);
  const auto other = OpenConnection();
  std::thread change;
  EXPECT_THAT(other->Transaction([&] {
    EXPECT_THAT(other->RunScript(kLocksOfAPublication), Succeeds());
    change = std::thread([&] {
      EXPECT_THAT(catalog->SubmitImport(AnimationCalled("a"), ImportOf("a")), Succeeds());
    });
    absl::SleepFor(absl::Milliseconds(1200));
    EXPECT_THAT(catalog->GetAnimation("a"), Fails(Code::kNotFound, "'a'"));
    return absl::OkStatus();
  }),
              Succeeds());
  change.join();
  EXPECT_THAT(catalog->GetAnimation("a"), Succeeds());
}

// Catalogs in two schemas of a database do not wait for each other.
TEST_F(PostgresCatalogTest, ItsLockIsOfOneSchema) {
  const auto catalog = MustOpen();
  const std::string other_url = server_.NewUrl();
  const auto other_catalog = OpenPostgresCatalog(other_url);
  ASSERT_THAT(other_catalog, Succeeds());
  const auto holder =
      PostgresConnection::Open(*ParsePostgresUrl(other_url, absl::Seconds(10)), PostgresOptions());
  ASSERT_THAT(holder, Succeeds());
  std::thread change;  // holds the locks of the other catalog, and waits
  EXPECT_THAT((*holder)->Transaction([&] {
    EXPECT_THAT((*holder)->Run("LOCK TABLE animations IN SHARE MODE"), Succeeds());
    change = std::thread([&] {
      EXPECT_THAT((*other_catalog)->SubmitImport(AnimationCalled("a"), ImportOf("a")), Succeeds());
    });
    AwaitWaiting(1);
    EXPECT_THAT(catalog->SubmitImport(AnimationCalled("a"), ImportOf("a")), Succeeds());
    return absl::OkStatus();
  }),
              Succeeds());
  change.join();
}

// Publications that follow each other without a gap do not keep a change from its turn.
TEST_F(PostgresCatalogTest, AChangeGoesBeforePublicationsThatComeLater) {
  const auto catalog = MustOpen();
  std::atomic<bool> is_done = false;
  std::vector<std::thread> publications;
  absl::Barrier* const all_hold = new absl::Barrier(5);
  for (int k = 0; k < 4; ++k) {
    publications.emplace_back([&, k] {
      const auto connection = OpenConnection();
      bool is_first = true;
      while (!is_done) {
        EXPECT_THAT(connection->Transaction([&] {
          EXPECT_THAT(connection->RunScript(kLocksOfAPublication), Succeeds());
          if (is_first && all_hold->Block()) delete all_hold;
          is_first = false;
          absl::SleepFor(absl::Milliseconds(100 + 10 * k));
          return absl::OkStatus();
        }),
                    Succeeds());
      }
    });
  }
  if (all_hold->Block()) delete all_hold;
  EXPECT_THAT(catalog->SubmitImport(AnimationCalled("a"), ImportOf("a")), Succeeds());
  is_done = true;
  for (std::thread& thread : publications) thread.join();
}

TEST_F(PostgresCatalogTest, ANewWorkerRemovesTheRowsOfOldOnes) {
  absl::Time now = absl::FromUnixSeconds(1700000000);
  CatalogOptions options;
  options.now = [&] { return now; };
  const auto seen = [&](const std::string& name) {
    pb::WorkerRecord worker;
    worker.set_name(name);
    EXPECT_THAT(MustOpen(options)->RecordWorker(worker), Succeeds());
    return Run("SELECT string_agg(name, ' ' ORDER BY name) FROM workers");
  };
  EXPECT_EQ(seen("a"), "a");
  EXPECT_EQ(seen("b"), "a b");
  now += absl::Hours(25);
  EXPECT_EQ(seen("b"), "a b");
  EXPECT_EQ(seen("c"), "b c");
}

// Whoever freezes in the middle of a change loses it, and with it the lock that others wait for.
TEST_F(PostgresCatalogTest, AFrozenClientDoesNotHoldUpOthers) {
  MustOpen();
  const auto target = ParsePostgresUrl(url_, absl::Seconds(10));
  const auto frozen =
      PostgresConnection::Open(*target, PostgresOptions{.timeout = absl::Seconds(2), .now = {}});
  ASSERT_THAT(frozen, Succeeds());
  EXPECT_THAT((*frozen)->Transaction([&] {
    EXPECT_THAT((*frozen)->Run("SELECT 1 FROM catalog_version FOR UPDATE"), Succeeds());
    EXPECT_THAT(MustOpen()->SubmitImport(AnimationCalled("a"), ImportOf("a")), Succeeds());
    return absl::OkStatus();
  }),
              Fails(Code::kUnavailable, "database postgresql://liquidblend@"));
}

TEST_F(PostgresCatalogTest, ManyThreadsShareFewConnections) {
  CatalogOptions options;
  options.max_connections = 2;
  const auto catalog = MustOpen(options);
  std::vector<std::thread> threads;
  for (int k = 0; k < 8; ++k) {
    threads.emplace_back([&, k] {
      const std::string id = absl::StrCat("a", k);
      EXPECT_THAT(catalog->SubmitImport(AnimationCalled(id), ImportOf(id)), Succeeds());
      EXPECT_THAT(catalog->GetAnimation(id), Succeeds());
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(catalog->ListAnimations(0, "")->records.size(), 8);
  EXPECT_EQ(Run("SELECT count(*) FROM pg_stat_activity WHERE query LIKE '%animations%' AND pid <> "
                "pg_backend_pid()"),
            "2");
}

// ---- a large catalog

TEST_F(PostgresCatalogTest, ListsTheBlobsOfManyRowsInPages) {
  const auto catalog = MustOpen();
  RunScript(
      "INSERT INTO animations SELECT 'a' || k, 2, 'blob ' || k, '', '', 0 FROM "
      "generate_series(1, 45000) AS k; "
      "INSERT INTO families SELECT 'f' || k, 1, CASE k % 2 WHEN 0 THEN '' ELSE 'blob ' || k END, "
      "'', '', 0 FROM generate_series(45001, 65000) AS k; "
      "INSERT INTO kept_versions SELECT 'f' || k % 2, k, 'blob ' || k, '', 0, '' FROM "
      "generate_series(64001, 105000) AS k");
  std::vector<std::string> expected;
  for (int k = 1; k <= 105000; ++k) {
    const bool has_blob = k <= 45000 || k > 64000 || k % 2 == 1;
    if (has_blob) expected.push_back(absl::StrCat("blob ", k));
  }
  std::sort(expected.begin(), expected.end());
  const auto blobs = catalog->ListReferencedBlobs();
  ASSERT_THAT(blobs, Succeeds());
  EXPECT_TRUE(*blobs == expected) << blobs->size() << " instead of " << expected.size();
}

TEST_F(PostgresCatalogTest, ListsTheBlobsOfManyJobsInPages) {
  const auto catalog = MustOpen();
  ASSERT_THAT(catalog->SubmitImport(AnimationCalled("a"), ImportOf("a")), Succeeds());
  pb::JobRecord child;
  child.set_result_blob("result");
  child.set_checkpoint_blob("checkpoint");
  const std::string hex = absl::BytesToHexString(child.SerializeAsString());
  // Rows that refer to nothing on either side of it, of all states, and 1,500 children of a job.
  RunScript(absl::StrCat(
      "INSERT INTO jobs (id, state, subject, record) SELECT 'job-' || k, 1 + k % 6, 's', '' FROM "
      "generate_series(1, 9000) AS k; "
      "INSERT INTO jobs (id, state, subject, parent, record) SELECT 'child-' || k, 3, 's', 'p', "
      "CASE WHEN k = 1500 THEN decode('",
      hex,
      "', 'hex') ELSE '' END FROM "
      "generate_series(1, 1500) AS k"));
  ASSERT_THAT(catalog->SubmitImport(AnimationCalled("b"), ImportOf("b")), Succeeds());
  const auto blobs = catalog->ListReferencedBlobs();
  ASSERT_THAT(blobs, Succeeds());
  EXPECT_THAT(*blobs, ::testing::ElementsAre("checkpoint", "result", "upload-of-a", "upload-of-b"));
}

// A rollback moves the blob of a kept version to the family, and the published one to the kept.
TEST_F(PostgresCatalogTest, ListsTheBlobsOfVersionsThatMoveMeanwhile) {
  MustOpen();
  RunScript(
      "INSERT INTO families VALUES ('f', 1, 'blob 1', '', '', 0); "
      "INSERT INTO kept_versions VALUES ('f', 2, 'blob 2', '', 0, '')");
  ListWhile(
      "BEGIN; UPDATE kept_versions SET blob = (SELECT blob FROM families); "
      "UPDATE families SET blob = 'blob ' || (3 - right(blob, 1)::int); COMMIT",
      {"blob 1", "blob 2"});
}

TEST_F(PostgresCatalogTest, ListsTheBlobsOfJobsThatChangeTheirStatesMeanwhile) {
  ASSERT_THAT(MustOpen()->SubmitImport(AnimationCalled("a"), ImportOf("a")), Succeeds());
  ListWhile("UPDATE jobs SET state = CASE state WHEN 1 THEN 2 WHEN 2 THEN 6 ELSE 1 END",
            {"upload-of-a"});
}

TEST_F(PostgresCatalogTest, FindsAPageOfBlobsByAnIndex) {
  MustOpen();
  RunScript(
      "INSERT INTO families SELECT 'f' || k, 1, 'b', '', '', 0 FROM generate_series(1, 9000) AS k; "
      "INSERT INTO kept_versions SELECT 'f' || k, 1, 'b', '', 0, '' FROM generate_series(1, 9000) "
      "AS k; "
      "INSERT INTO jobs (id, state, subject, parent, record) SELECT 'job-' || k, 1 + k % 6, 's', "
      "CASE k % 4 WHEN 0 THEN 'p' || k END, '' FROM generate_series(1, 20000) AS k; ANALYZE jobs, "
      "families, kept_versions");
  const auto plan = [&](const std::string& statement) {
    std::string text = Run("EXPLAIN (FORMAT JSON) " + statement);
    EXPECT_THAT(text, ::testing::Not(::testing::HasSubstr("Seq Scan")));
    EXPECT_THAT(text, ::testing::Not(::testing::HasSubstr("\"Sort\"")));
    return text;
  };
  EXPECT_THAT(plan("SELECT family, blob FROM (SELECT id AS family, blob FROM families UNION ALL "
                   "SELECT family, blob FROM kept_versions) AS versions WHERE family > 'f' "
                   "ORDER BY family LIMIT 50"),
              ::testing::HasSubstr("Merge Append"));
  EXPECT_THAT(plan("SELECT number, record FROM jobs WHERE state = 1 AND number > 7 "
                   "ORDER BY number LIMIT 50"),
              ::testing::ContainsRegex("jobs_by_state|jobs_pkey"));
  EXPECT_THAT(plan("SELECT parent, record FROM jobs WHERE parent > 'p' ORDER BY parent LIMIT 50"),
              ::testing::HasSubstr("jobs_by_parent"));
}

// ---- a database that goes away

TEST_F(PostgresCatalogTest, DoesNotNoticeARestartBetweenTwoCalls) {
  const auto catalog = MustOpen();
  ASSERT_THAT(catalog->SubmitImport(AnimationCalled("a"), ImportOf("a")), Succeeds());
  server_.Restart();
  EXPECT_THAT(catalog->GetAnimation("a"), Succeeds());
  server_.Restart();
  EXPECT_THAT(catalog->SubmitImport(AnimationCalled("b"), ImportOf("b")), Succeeds());
}

TEST_F(PostgresCatalogTest, RecoversOnceTheDatabaseIsBack) {
  const auto catalog = MustOpen();
  ASSERT_THAT(catalog->SubmitImport(AnimationCalled("a"), ImportOf("a")), Succeeds());
  ASSERT_TRUE(*catalog->WaitForJob(absl::Milliseconds(1)));
  server_.Crash();
  const absl::Status read = catalog->GetAnimation("a").status();
  EXPECT_THAT(read, Fails(Code::kUnavailable, "database postgresql://liquidblend@"));
  EXPECT_THAT(std::string(read.message()), ::testing::Not(::testing::HasSubstr("secret")));
  EXPECT_THAT(catalog->SubmitImport(AnimationCalled("b"), ImportOf("b")),
              Fails(Code::kUnavailable, "database postgresql://"));
  EXPECT_THAT(catalog->WaitForJob(absl::Seconds(30)), Fails(Code::kUnavailable, "postgresql://"));
  server_.Start();
  EXPECT_THAT(catalog->GetAnimation("a"), Succeeds());
  EXPECT_THAT(catalog->GetAnimation("b"), Fails(Code::kNotFound, "'b'"));
  EXPECT_THAT(catalog->SubmitImport(AnimationCalled("b"), ImportOf("b")), Succeeds());
  EXPECT_TRUE(*catalog->WaitForJob(absl::Milliseconds(1)));
}

TEST_F(PostgresCatalogTest, AChangeIsWholeOrNotThereWhenTheDatabaseCrashesInIt) {
  const auto catalog = MustOpen();
  for (int k = 0; k < 3; ++k) {
    std::thread crash([&] { server_.Crash(); });
    int num_submitted = 0;
    while (catalog
               ->SubmitImport(AnimationCalled(absl::StrCat("a", k, ".", num_submitted)),
                              ImportOf(absl::StrCat("a", k, ".", num_submitted)))
               .ok()) {
      ++num_submitted;
    }
    crash.join();
    server_.Start();
    EXPECT_EQ(Run("SELECT (SELECT count(*) FROM animations) = (SELECT count(*) FROM jobs)"), "t");
    for (int n = 0; n < num_submitted; ++n) {
      EXPECT_THAT(catalog->GetAnimation(absl::StrCat("a", k, ".", n)), Succeeds());
    }
  }
}

// ---- writes that are denied

TEST_F(PostgresCatalogTest, ADeniedWriteIsOfTheEnvironmentAndLosesNoJob) {
  MustOpen();
  const std::string schema = url_.substr(url_.rfind("%3D") + 3);
  const std::string tables = absl::StrCat("ALL TABLES IN SCHEMA ", schema);
  const auto catalog = OpenPostgresCatalog(UrlOfNewRole("producer", schema));
  ASSERT_THAT(catalog, Succeeds());
  ASSERT_THAT((*catalog)->SubmitImport(AnimationCalled("a"), ImportOf("a")), Succeeds());
  Run(absl::StrCat("REVOKE INSERT, UPDATE, DELETE ON ", tables, " FROM producer"));
  const absl::Status submitted =
      (*catalog)->SubmitImport(AnimationCalled("b"), ImportOf("b")).status();
  const absl::Status leased = (*catalog)->LeaseJob("worker", absl::Minutes(1)).status();
  for (const absl::Status& denied : {submitted, leased}) {
    EXPECT_THAT(denied, Fails(Code::kPermissionDenied, "permission denied for table"));
    EXPECT_TRUE(base::IsTransient(denied)) << denied;
  }
  EXPECT_THAT((*catalog)->GetAnimation("a"), Succeeds());
  Run(absl::StrCat("GRANT ALL ON ", tables, " TO producer"));
  const auto lease = (*catalog)->LeaseJob("worker", absl::Minutes(1));
  ASSERT_TRUE(lease.ok() && lease->has_value()) << lease.status();
  EXPECT_EQ((*lease)->job.attempts(), 1);
  EXPECT_THAT((*catalog)->PublishAnimation((*lease)->lease_id, AnimationCalled("a")), Succeeds());
}

// Only the owner of a table may add indexes to it.
TEST_F(PostgresCatalogTest, WorksWithoutTheIndexesThatItMayNotAdd) {
  MustOpen();
  const std::string url = UrlOfNewRole("guest", url_.substr(url_.rfind("%3D") + 3));
  Run("DROP INDEX jobs_queued_by_turn");
  Run("DROP INDEX jobs_running_by_due");
  const auto catalog = OpenPostgresCatalog(url);
  ASSERT_THAT(catalog, Succeeds());
  ASSERT_THAT((*catalog)->SubmitImport(AnimationCalled("a"), ImportOf("a")), Succeeds());
  const auto lease = (*catalog)->LeaseJob("worker", absl::Minutes(1));
  EXPECT_TRUE(lease.ok() && lease->has_value()) << lease.status();
}

// A worker's user may be the first who is of this version and may create tables.
TEST_F(PostgresCatalogTest, AllMayReadAnIdThatAnotherUserHasAdded) {
  MustOpen();
  const std::string schema = url_.substr(url_.rfind("%3D") + 3);
  const std::string server_url = UrlOfNewRole("server_user", schema);
  const std::string worker_url = UrlOfNewRole("worker_user", schema);
  Run("DROP TABLE catalog_id");
  ASSERT_THAT(OpenPostgresCatalog(worker_url), Succeeds());
  EXPECT_EQ(Run("SELECT relowner::regrole FROM pg_class WHERE oid = 'catalog_id'::regclass"),
            "worker_user");
  const auto catalog = OpenPostgresCatalog(server_url);
  ASSERT_THAT(catalog, Succeeds());
  EXPECT_THAT((*catalog)->Id(), Succeeds());
  // A program of before has not granted that. Its owner does when it is started again.
  Run("REVOKE SELECT ON catalog_id FROM PUBLIC");
  ASSERT_THAT(OpenPostgresCatalog(server_url), Succeeds());
  EXPECT_THAT((*catalog)->Id(), Fails(Code::kPermissionDenied, "catalog_id"));
  ASSERT_THAT(OpenPostgresCatalog(worker_url), Succeeds());
  EXPECT_THAT((*catalog)->Id(), Succeeds());
}

// ---- killed in the middle

TEST_F(PostgresCatalogTest, HasNothingOfAChangeKilledBeforeItsCommitAndAllAfter) {
  MustOpen();
  const auto submit = [&] {
    const auto catalog = OpenPostgresCatalog(url_);
    if (catalog.ok()) (*catalog)->SubmitImport(AnimationCalled("a"), ImportOf("a")).IgnoreError();
  };
  EXPECT_TRUE(DiesAt("catalog.before_commit", submit));
  EXPECT_TRUE(MustOpen()->ListAnimations(0, "")->records.empty());
  EXPECT_TRUE(MustOpen()->ListJobs(0, "")->records.empty());
  EXPECT_TRUE(DiesAt("catalog.after_commit", submit));
  EXPECT_EQ(MustOpen()->ListAnimations(0, "")->records.size(), 1);
  EXPECT_EQ(MustOpen()->ListJobs(0, "")->records.size(), 1);
}

TEST_F(PostgresCatalogTest, AnotherWorkerFinishesAJobWhosePublicationWasKilled) {
  const auto job = MustOpen()->SubmitImport(AnimationCalled("a"), ImportOf("a"));
  ASSERT_THAT(job, Succeeds());
  EXPECT_TRUE(DiesAt("publish.before_commit", [&] {
    const auto catalog = OpenPostgresCatalog(url_);
    if (!catalog.ok()) return;
    const auto lease = (*catalog)->LeaseJob("victim", absl::Minutes(1));
    if (!lease.ok() || !lease->has_value()) return;
    (*catalog)->PublishAnimation((*lease)->lease_id, AnimationCalled("a")).IgnoreError();
  }));
  EXPECT_EQ(MustOpen()->GetAnimation("a")->state(), pb::AnimationRecord::IMPORTING);
  CatalogOptions later;
  later.now = [] { return absl::Now() + absl::Minutes(2); };
  const auto catalog = MustOpen(later);
  std::optional<Lease> lease;
  // The database may not have heard yet that the other worker is gone, who has locked the job.
  for (int k = 0; k < 3000 && !lease.has_value(); ++k) {
    const auto next = catalog->LeaseJob("other", absl::Minutes(1));
    ASSERT_THAT(next, Succeeds());
    lease = *next;
    if (!lease.has_value()) absl::SleepFor(absl::Milliseconds(10));
  }
  ASSERT_TRUE(lease.has_value());
  EXPECT_EQ(lease->job.attempts(), 2);
  EXPECT_THAT(catalog->PublishAnimation(lease->lease_id, AnimationCalled("a")), Succeeds());
  EXPECT_EQ(MustOpen()->GetAnimation("a")->state(), pb::AnimationRecord::READY);
}

}  // namespace
}  // namespace liquidblend::store
