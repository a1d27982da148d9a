// The catalog in a PostgreSQL database (docs/formats.md, "In PostgreSQL").
#include <algorithm>
#include <iterator>
#include <memory>
#include <string>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/strings/str_cat.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "core/base/log.h"
#include "core/base/retry.h"
#include "core/base/status_macros.h"
#include "core/base/steady_cond_var.h"
#include "core/store/catalog/owner_tables.h"
#include "core/store/catalog/sql_catalog.h"
#include "core/store/sql/postgres.h"
#include "core/store/sql/postgres_pool.h"

namespace liquidblend::store {
namespace {

// Advisory locks: kMigrationLock is one for the database, kChangesLock one for each catalog
// (schema).
constexpr int64_t kMigrationLock = 0x4c51424c;  // "LQBL"
constexpr char kChangesLock[] = "x'4c51424d'::int, 'catalog_version'::regclass::oid::int";
// How long a change waits for the lock at one time. PostgreSQL looks for a deadlock after a wait of
// one second (deadlock_timeout), which holds up all locks, the longer the more who wait.
constexpr absl::Duration kLockWait = absl::Milliseconds(500);
constexpr absl::Duration kPauseBetweenWaits = absl::Milliseconds(250);

// kPostgresMigrations[k] makes version k + 1 out of version k. Never changed once released, only
// added to; docs/formats.md describes the newest. Columns and their meaning are SQLite's.
constexpr const char* kPostgresMigrations[] = {R"sql(
  CREATE TABLE catalog_version (version BIGINT NOT NULL, changed_at TIMESTAMPTZ NOT NULL);
  INSERT INTO catalog_version VALUES (0, now());
  CREATE TABLE animations (
    id TEXT COLLATE "C" PRIMARY KEY, state BIGINT NOT NULL, blob TEXT NOT NULL,
    record BYTEA NOT NULL);
  CREATE TABLE families (
    id TEXT COLLATE "C" PRIMARY KEY, version BIGINT NOT NULL, blob TEXT NOT NULL,
    record BYTEA NOT NULL);
  CREATE TABLE family_members (
    family TEXT COLLATE "C" NOT NULL, animation TEXT COLLATE "C" NOT NULL,
    PRIMARY KEY (family, animation));
  CREATE INDEX family_members_by_animation ON family_members (animation, family);
  CREATE TABLE family_versions (
    family TEXT COLLATE "C" PRIMARY KEY, last_version BIGINT NOT NULL);
  CREATE TABLE jobs (
    number BIGINT GENERATED ALWAYS AS IDENTITY PRIMARY KEY, id TEXT COLLATE "C" NOT NULL UNIQUE,
    state BIGINT NOT NULL, subject TEXT COLLATE "C" NOT NULL, request_id TEXT COLLATE "C" UNIQUE,
    lease_id TEXT COLLATE "C" UNIQUE, lease_expires_us BIGINT, parent TEXT COLLATE "C",
    record BYTEA NOT NULL);
  CREATE INDEX jobs_by_state ON jobs (state, number);
  CREATE INDEX jobs_by_parent ON jobs (parent, number);
  CREATE INDEX jobs_to_do ON jobs (number) WHERE state IN (1, 2);
  CREATE FUNCTION notify_job() RETURNS trigger LANGUAGE plpgsql AS $$
    BEGIN
      PERFORM pg_notify('liquidblend_jobs', TG_TABLE_SCHEMA);
      RETURN NULL;
    END
  $$;
  CREATE TRIGGER jobs_queued AFTER INSERT OR UPDATE OF state ON jobs
    FOR EACH ROW WHEN (NEW.state = 1) EXECUTE FUNCTION notify_job();
)sql",
                                               R"sql(
  ALTER TABLE jobs RENAME COLUMN lease_expires_us TO due_us;
  UPDATE jobs SET due_us = 0 WHERE state = 1;
  DROP INDEX jobs_to_do;
  ALTER TABLE jobs ADD COLUMN owner TEXT COLLATE "C" NOT NULL DEFAULT '';
  ALTER TABLE jobs ADD COLUMN priority BIGINT NOT NULL DEFAULT 0;
  ALTER TABLE jobs ADD COLUMN turn BIGINT NOT NULL DEFAULT 0;
  ALTER TABLE jobs ADD COLUMN attempts BIGINT NOT NULL DEFAULT 0;
  ALTER TABLE jobs ADD COLUMN memory_bytes BIGINT NOT NULL DEFAULT 0;
  CREATE TABLE workers (
    name TEXT COLLATE "C" PRIMARY KEY, memory_bytes BIGINT NOT NULL, seen_us BIGINT NOT NULL);
  CREATE INDEX jobs_to_do ON jobs (priority DESC, turn, number, due_us, memory_bytes)
    WHERE state IN (1, 2);
  CREATE INDEX jobs_by_turn ON jobs (priority, turn) WHERE attempts > 0;
  CREATE INDEX jobs_by_owner ON jobs (owner, priority, turn) WHERE state IN (1, 2, 6);
)sql",
                                               R"sql(
  ALTER TABLE jobs ADD COLUMN ended_us BIGINT;
  UPDATE jobs SET ended_us = (extract(epoch FROM clock_timestamp()) * 1000000)::bigint
    WHERE state IN (3, 4, 5) AND parent IS NULL;
  CREATE INDEX jobs_by_end ON jobs (ended_us) WHERE ended_us IS NOT NULL;
)sql",
                                               R"sql(
  ALTER TABLE animations ADD COLUMN owner TEXT COLLATE "C" NOT NULL DEFAULT '';
  ALTER TABLE animations ADD COLUMN stored_bytes BIGINT NOT NULL DEFAULT 0;
  ALTER TABLE families ADD COLUMN owner TEXT COLLATE "C" NOT NULL DEFAULT '';
  ALTER TABLE families ADD COLUMN stored_bytes BIGINT NOT NULL DEFAULT 0;
  CREATE INDEX animations_by_owner ON animations (owner, blob, stored_bytes);
  CREATE INDEX families_by_owner ON families (owner, blob, stored_bytes);
)sql",
                                               R"sql(
  ALTER TABLE workers ADD COLUMN refusal TEXT NOT NULL DEFAULT '';
)sql",
                                               R"sql(
  CREATE TABLE kept_versions (
    family TEXT COLLATE "C" NOT NULL, version BIGINT NOT NULL, blob TEXT NOT NULL,
    owner TEXT COLLATE "C" NOT NULL, stored_bytes BIGINT NOT NULL, record BYTEA NOT NULL,
    PRIMARY KEY (family, version));
  CREATE INDEX kept_versions_by_owner ON kept_versions (owner, blob, stored_bytes);
)sql"};
// Additions that older programs leave alone, so that they need no version of their own.
constexpr char kPostgresUses[] = R"sql(
  CREATE TABLE family_uses (
    family TEXT COLLATE "C" NOT NULL, day BIGINT NOT NULL, num_frames BIGINT NOT NULL,
    PRIMARY KEY (family, day));
)sql";
constexpr char kPostgresId[] = R"sql(
  CREATE TABLE catalog_id (id TEXT NOT NULL);
  INSERT INTO catalog_id SELECT replace(gen_random_uuid()::text, '-', '');
  GRANT SELECT ON catalog_id TO PUBLIC;
)sql";
constexpr char kGrantPostgresId[] = "GRANT SELECT ON catalog_id TO PUBLIC";
constexpr char kPostgresIndexes[] = R"sql(
  CREATE INDEX IF NOT EXISTS jobs_queued_by_turn ON jobs (priority DESC, turn, number, memory_bytes)
    WHERE state = 1;
  CREATE INDEX IF NOT EXISTS jobs_queued_by_due ON jobs (due_us, memory_bytes) WHERE state = 1;
  CREATE INDEX IF NOT EXISTS jobs_running_by_due ON jobs (due_us, memory_bytes) WHERE state = 2;
  CREATE INDEX IF NOT EXISTS jobs_unfinished_by_subject ON jobs (subject)
    WHERE state IN (1, 2, 6) AND parent IS NULL;
)sql";
constexpr int64_t kPostgresSchemaVersion = std::size(kPostgresMigrations);
constexpr int64_t kPostgresFirstWithOwners = 4;
constexpr absl::Duration kSlowPoll = absl::Seconds(5);
constexpr char kChannel[] = "liquidblend_jobs";
constexpr char kSelectVersion[] = "SELECT version FROM catalog_version";

absl::Status CheckIsCurrent(const Sql& sql, int64_t version) {
  return CheckTablesVersion(sql, version, kPostgresSchemaVersion, kPostgresSchemaVersion);
}

absl::Status CheckIsCurrent(Sql& sql) {
  LB_ASSIGN_OR_RETURN(const int64_t version, QueryInt(sql, kSelectVersion));
  return CheckIsCurrent(sql, version);
}

absl::StatusOr<int64_t> CountRelations(Sql& sql, absl::string_view condition) {
  return QueryInt(sql, absl::StrCat("SELECT count(*) FROM pg_class WHERE relnamespace = "
                                    "to_regnamespace(current_schema()::text)",
                                    condition));
}

absl::StatusOr<int64_t> CountTables(Sql& sql, absl::string_view condition) {
  return CountRelations(sql, absl::StrCat(" AND relkind IN ('r', 'p')", condition));
}

absl::Status Migrate(PostgresConnection& sql) {
  LB_RETURN_IF_ERROR(sql.Run("SELECT pg_advisory_xact_lock($1)", {kMigrationLock}));
  LB_ASSIGN_OR_RETURN(const int64_t num_ours,
                      CountTables(sql, " AND relname IN ('catalog_version', 'jobs')"));
  LB_ASSIGN_OR_RETURN(const int64_t num_tables, CountTables(sql, ""));
  if (num_ours != 2 && num_tables > 0) {
    return absl::FailedPreconditionError(
        absl::StrCat("database ", sql.name(), " is not a liquidblend catalog"));
  }
  int64_t version = 0;
  if (num_tables > 0) {
    LB_RETURN_IF_ERROR(sql.Run(absl::StrCat("SELECT pg_advisory_xact_lock(", kChangesLock, ")")));
    LB_ASSIGN_OR_RETURN(version, QueryInt(sql, "SELECT version FROM catalog_version FOR UPDATE"));
    LB_RETURN_IF_ERROR(CheckTablesVersion(sql, version, 1, kPostgresSchemaVersion));
  }
  if (version == kPostgresSchemaVersion) return absl::OkStatus();
  for (int64_t k = version; k < kPostgresSchemaVersion; ++k) {
    LB_RETURN_IF_ERROR(sql.RunScript(kPostgresMigrations[k]));
  }
  if (version < kPostgresFirstWithOwners) LB_RETURN_IF_ERROR(NoteOwners(sql));
  return sql.Run("UPDATE catalog_version SET version = $1, changed_at = now()",
                 {kPostgresSchemaVersion});
}

absl::Status AddUses(PostgresConnection& sql) {
  LB_ASSIGN_OR_RETURN(const int64_t num_there, CountTables(sql, " AND relname = 'family_uses'"));
  return num_there > 0 ? absl::OkStatus() : sql.RunScript(kPostgresUses);
}

// Adds the catalog's id if it is missing. Any user who may create tables in the schema can, and
// then owns it, so all may read it: it is no secret. Only its owner can grant that later. Garbage
// collection alone needs the id, so a user who may not add it is no error.
absl::Status AddId(PostgresConnection& sql) {
  LB_ASSIGN_OR_RETURN(
      const int64_t num_done,
      CountTables(sql,
                  " AND relname = 'catalog_id' AND (pg_get_userbyid(relowner) <> current_user OR "
                  "has_table_privilege('public', oid, 'SELECT'))"));
  if (num_done > 0) return absl::OkStatus();
  const absl::Status added = sql.Transaction([&]() -> absl::Status {
    LB_RETURN_IF_ERROR(sql.Run("SELECT pg_advisory_xact_lock($1)", {kMigrationLock}));
    LB_ASSIGN_OR_RETURN(const int64_t num_there, CountTables(sql, " AND relname = 'catalog_id'"));
    return sql.RunScript(num_there > 0 ? kGrantPostgresId : kPostgresId);
  });
  if (!absl::IsPermissionDenied(added)) return added;
  base::LogWarning(
      absl::StrCat("no garbage is collected until a user who may create tables adds the catalog's "
                   "id: ",
                   added.message()));
  return absl::OkStatus();
}

// Whether all tables are there and of this version. Takes no lock: a thousand workers that start at
// once need not wait for each other.
absl::StatusOr<bool> HasTables(PostgresConnection& sql) {
  LB_ASSIGN_OR_RETURN(
      const int64_t num_ours,
      CountTables(sql, " AND relname IN ('catalog_version', 'jobs', 'family_uses')"));
  if (num_ours != 3) return false;
  LB_ASSIGN_OR_RETURN(const int64_t version, QueryInt(sql, kSelectVersion));
  return version == kPostgresSchemaVersion;
}

absl::Status MakeTables(PostgresConnection& sql) {
  LB_ASSIGN_OR_RETURN(const bool has_tables, HasTables(sql));
  if (has_tables) return absl::OkStatus();
  return sql.Transaction([&]() -> absl::Status {
    LB_RETURN_IF_ERROR(Migrate(sql));
    return AddUses(sql);
  });
}

// Adds the indexes that are missing. The catalog gives right answers without them, so a user who
// may not add them (only the owner of the tables may) is no error.
absl::Status MakeIndexes(PostgresConnection& sql) {
  LB_ASSIGN_OR_RETURN(const int64_t num_there,
                      CountRelations(sql,
                                     " AND relkind = 'i' AND relname IN ('jobs_queued_by_turn', "
                                     "'jobs_queued_by_due', 'jobs_running_by_due', "
                                     "'jobs_unfinished_by_subject')"));
  if (num_there == 4) return absl::OkStatus();
  const absl::Status made = sql.Transaction([&]() -> absl::Status {
    // A history of years takes more than the time limit of other statements.
    LB_RETURN_IF_ERROR(
        sql.RunScript("SET LOCAL statement_timeout = '10min'; SET LOCAL lock_timeout = '10min'"));
    LB_RETURN_IF_ERROR(sql.Run("SELECT pg_advisory_xact_lock($1)", {kMigrationLock}));
    return sql.RunScript(kPostgresIndexes);
  });
  if (!absl::IsPermissionDenied(made)) return made;
  base::LogWarning(absl::StrCat(
      "the queue and deletions are slow until the owner of the tables adds its indexes: ",
      made.message()));
  return absl::OkStatus();
}

class PostgresBackend : public SqlBackend {
 public:
  PostgresBackend(PostgresTarget target, PostgresOptions options, int max_connections)
      : timeout_(options.timeout), pool_(std::move(target), std::move(options), max_connections) {}

  absl::Status Prepare() {
    return pool_.Use([](PostgresConnection& sql) -> absl::Status {
      LB_RETURN_IF_ERROR(MakeTables(sql));
      LB_RETURN_IF_ERROR(AddId(sql));
      return MakeIndexes(sql);
    });
  }

  absl::Status Read(Body body) override {
    return pool_.Use([&](PostgresConnection& sql) { return body(sql); });
  }

  absl::Status ReadCurrent(Body body) override {
    return pool_.Use([&](PostgresConnection& sql) -> absl::Status {
      LB_RETURN_IF_ERROR(CheckIsCurrent(sql));
      LB_RETURN_IF_ERROR(body(sql));
      return CheckIsCurrent(sql);
    });
  }

  // The check after the snapshot is there because the snapshot does not see a change of the tables.
  absl::Status ReadSnapshot(Body body) override {
    return pool_.Use([&](PostgresConnection& sql) -> absl::Status {
      const absl::Status read = sql.Snapshot([&]() -> absl::Status {
        LB_RETURN_IF_ERROR(CheckIsCurrent(sql));
        return body(sql);
      });
      return read.ok() ? CheckIsCurrent(sql) : read;
    });
  }

  // All changes but those of ChangeJob() take two locks. A shared request for the advisory lock
  // waits behind an exclusive one, whereas a shared lock of a row passes an exclusive one that
  // waits. The row is there because programs of 0.2.0 lock it.
  absl::Status Change(Body body) override {
    return ChangeWith(absl::StrCat("SELECT pg_advisory_xact_lock(", kChangesLock,
                                   "); SELECT FROM catalog_version FOR UPDATE"),
                      body);
  }

  absl::Status ChangeShared(Body body) override {
    return ChangeWith(absl::StrCat("SELECT pg_advisory_xact_lock_shared(", kChangesLock,
                                   "); SELECT FROM catalog_version FOR SHARE"),
                      body);
  }

  // Without a lock, so tables that change between the check and the body go unnoticed until the
  // next call about the job.
  absl::Status ChangeJob(Body body) override {
    return pool_.Use([&](PostgresConnection& sql) {
      return sql.TransactionAfter(kSelectVersion, [&](int64_t version) -> absl::Status {
        LB_RETURN_IF_ERROR(CheckIsCurrent(sql, version));
        return body(sql);
      });
    });
  }

  // Asks `until_next` after a notification of a job (or of a pause before its next attempt), and
  // when a known job becomes due, for which there is no notification.
  absl::StatusOr<bool> WaitForJob(absl::Duration timeout, UntilNextJob until_next) override
      ABSL_LOCKS_EXCLUDED(listener_mutex_) {
    const absl::MutexLock lock(&listener_mutex_);
    const base::SteadyClock::time_point begin = base::SteadyClock::now();
    if (listener_ == nullptr) LB_RETURN_IF_ERROR(Listen());
    while (true) {
      if (base::Since(looked_) >= until_look_) {
        LB_ASSIGN_OR_RETURN(const absl::Duration pause, until_next());
        if (pause <= absl::ZeroDuration()) return true;
        LookAfter(std::min(pause, kSlowPoll));
      }
      const absl::Duration left =
          std::min(timeout - base::Since(begin), until_look_ - base::Since(looked_));
      const absl::StatusOr<bool> heard =
          listener_->AwaitNotification(std::max(left, absl::ZeroDuration()));
      if (!heard.ok()) listener_ = nullptr;
      if (heard.ok() && *heard) LookAfter(absl::ZeroDuration());
      if (!heard.ok() || *heard) return heard;
      if (base::Since(begin) >= timeout) return false;
    }
  }

 private:
  // Runs a transaction that takes these locks first. Between its waits for them it has neither a
  // transaction nor a connection.
  absl::Status ChangeWith(const std::string& locks, Body body) {
    const base::SteadyClock::time_point begin = base::SteadyClock::now();
    while (true) {
      bool is_locked = true;
      const absl::Status status = pool_.Use([&](PostgresConnection& sql) {
        return sql.Transaction([&]() -> absl::Status {
          LB_ASSIGN_OR_RETURN(is_locked, sql.TryLock(locks, kLockWait));
          if (!is_locked) return AreBusy(sql);
          LB_RETURN_IF_ERROR(CheckIsCurrent(sql));
          return body(sql);
        });
      });
      if (is_locked || base::Since(begin) >= timeout_) return status;
      absl::SleepFor(base::Jittered(kPauseBetweenWaits, 0.8));
    }
  }

  absl::Status AreBusy(const Sql& sql) const {
    return absl::UnavailableError(absl::StrCat("database ", sql.name(),
                                               ": other changes have held the catalog's lock for ",
                                               absl::FormatDuration(timeout_)));
  }

  absl::Status Listen() ABSL_EXCLUSIVE_LOCKS_REQUIRED(listener_mutex_) {
    LB_ASSIGN_OR_RETURN(std::unique_ptr<PostgresConnection> listener, pool_.Open());
    LB_RETURN_IF_ERROR(listener->Listen(kChannel));
    listener_ = std::move(listener);
    LookAfter(absl::ZeroDuration());  // for jobs that were queued before
    return absl::OkStatus();
  }

  void LookAfter(absl::Duration pause) ABSL_EXCLUSIVE_LOCKS_REQUIRED(listener_mutex_) {
    looked_ = base::SteadyClock::now();
    until_look_ = pause;
  }

  const absl::Duration timeout_;
  PostgresPool pool_;
  absl::Mutex listener_mutex_;
  std::unique_ptr<PostgresConnection> listener_ ABSL_GUARDED_BY(listener_mutex_);
  // The time of the last query, and until the next one, for jobs that become due without a
  // notification.
  base::SteadyClock::time_point looked_ ABSL_GUARDED_BY(listener_mutex_);
  absl::Duration until_look_ ABSL_GUARDED_BY(listener_mutex_);
};

}  // namespace

int64_t PostgresTablesVersion() { return kPostgresSchemaVersion; }

absl::StatusOr<std::unique_ptr<Catalog>> OpenPostgresCatalog(const std::string& url,
                                                             const CatalogOptions& options) {
  LB_RETURN_IF_ERROR(options.Validate());
  LB_ASSIGN_OR_RETURN(PostgresTarget target, ParsePostgresUrl(url, options.busy_timeout));
  auto backend = std::make_unique<PostgresBackend>(
      std::move(target), PostgresOptions{.timeout = options.busy_timeout, .now = options.now},
      options.max_connections);
  LB_RETURN_IF_ERROR(backend->Prepare());
  return MakeSqlCatalog(std::move(backend), options);
}

}  // namespace liquidblend::store
