// The catalog in a SQLite file (docs/formats.md, "The catalog").
#include <algorithm>
#include <iterator>
#include <memory>
#include <string>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/strings/str_cat.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/clock.h"
#include "core/base/posix_file.h"
#include "core/base/status_macros.h"
#include "core/base/steady_cond_var.h"
#include "core/store/catalog/owner_tables.h"
#include "core/store/catalog/sql_catalog.h"
#include "core/store/sql/sqlite.h"

namespace liquidblend::store {
namespace {

constexpr absl::Duration kPollInterval = absl::Milliseconds(50);
constexpr int64_t kApplicationId = 0x4c51424c;  // "LQBL"

// kSqliteMigrations[k] makes version k + 1 (PRAGMA user_version) out of version k. Never changed
// once released, only added to; docs/formats.md describes the newest.
constexpr const char* kSqliteMigrations[] = {R"sql(
  CREATE TABLE animations (
    id TEXT PRIMARY KEY, state INTEGER NOT NULL, blob TEXT NOT NULL, record BLOB NOT NULL) STRICT;
  CREATE TABLE families (
    id TEXT PRIMARY KEY, version INTEGER NOT NULL, blob TEXT NOT NULL, record BLOB NOT NULL) STRICT;
  CREATE TABLE family_members (
    family TEXT NOT NULL, animation TEXT NOT NULL, PRIMARY KEY (family, animation))
    STRICT, WITHOUT ROWID;
  CREATE INDEX family_members_by_animation ON family_members (animation, family);
  CREATE TABLE family_versions (
    family TEXT PRIMARY KEY, last_version INTEGER NOT NULL) STRICT;
  CREATE TABLE jobs (
    number INTEGER PRIMARY KEY AUTOINCREMENT, id TEXT NOT NULL UNIQUE, state INTEGER NOT NULL,
    subject TEXT NOT NULL, request_id TEXT UNIQUE, lease_id TEXT UNIQUE, lease_expires_us INTEGER,
    record BLOB NOT NULL) STRICT;
  CREATE INDEX jobs_by_state ON jobs (state, number);
)sql",
                                             R"sql(
  ALTER TABLE jobs ADD COLUMN parent TEXT;
  CREATE INDEX jobs_by_parent ON jobs (parent, number);
)sql",
                                             R"sql(
  ALTER TABLE jobs RENAME COLUMN lease_expires_us TO due_us;
  UPDATE jobs SET due_us = 0 WHERE state = 1;
  ALTER TABLE jobs ADD COLUMN owner TEXT NOT NULL DEFAULT '';
  ALTER TABLE jobs ADD COLUMN priority INTEGER NOT NULL DEFAULT 0;
  ALTER TABLE jobs ADD COLUMN turn INTEGER NOT NULL DEFAULT 0;
  ALTER TABLE jobs ADD COLUMN attempts INTEGER NOT NULL DEFAULT 0;
  ALTER TABLE jobs ADD COLUMN memory_bytes INTEGER NOT NULL DEFAULT 0;
  CREATE TABLE workers (
    name TEXT PRIMARY KEY, memory_bytes INTEGER NOT NULL, seen_us INTEGER NOT NULL) STRICT;
  CREATE INDEX jobs_to_do ON jobs (priority DESC, turn, number, due_us, memory_bytes)
    WHERE state IN (1, 2);
  CREATE INDEX jobs_by_turn ON jobs (priority, turn) WHERE attempts > 0;
  CREATE INDEX jobs_by_owner ON jobs (owner, priority, turn) WHERE state IN (1, 2, 6);
)sql",
                                             R"sql(
  ALTER TABLE jobs ADD COLUMN ended_us INTEGER;
  UPDATE jobs SET ended_us = CAST(strftime('%s', 'now') AS INTEGER) * 1000000
    WHERE state IN (3, 4, 5) AND parent IS NULL;
  CREATE INDEX jobs_by_end ON jobs (ended_us) WHERE ended_us IS NOT NULL;
)sql",
                                             R"sql(
  ALTER TABLE animations ADD COLUMN owner TEXT NOT NULL DEFAULT '';
  ALTER TABLE animations ADD COLUMN stored_bytes INTEGER NOT NULL DEFAULT 0;
  ALTER TABLE families ADD COLUMN owner TEXT NOT NULL DEFAULT '';
  ALTER TABLE families ADD COLUMN stored_bytes INTEGER NOT NULL DEFAULT 0;
  CREATE INDEX animations_by_owner ON animations (owner, blob, stored_bytes);
  CREATE INDEX families_by_owner ON families (owner, blob, stored_bytes);
)sql",
                                             R"sql(
  ALTER TABLE workers ADD COLUMN refusal TEXT NOT NULL DEFAULT '';
)sql",
                                             R"sql(
  CREATE TABLE kept_versions (
    family TEXT NOT NULL, version INTEGER NOT NULL, blob TEXT NOT NULL, owner TEXT NOT NULL,
    stored_bytes INTEGER NOT NULL, record BLOB NOT NULL, PRIMARY KEY (family, version)) STRICT;
  CREATE INDEX kept_versions_by_owner ON kept_versions (owner, blob, stored_bytes);
)sql"};
// Additions that older programs leave alone, so that they need no version of their own.
constexpr char kSqliteAdditions[] = R"sql(
  CREATE TABLE IF NOT EXISTS family_uses (
    family TEXT NOT NULL, day INTEGER NOT NULL, num_frames INTEGER NOT NULL,
    PRIMARY KEY (family, day)) STRICT, WITHOUT ROWID;
  CREATE TABLE IF NOT EXISTS catalog_id (id TEXT NOT NULL) STRICT;
  INSERT INTO catalog_id SELECT lower(hex(randomblob(16)))
    WHERE NOT EXISTS (SELECT * FROM catalog_id);
  CREATE INDEX IF NOT EXISTS jobs_queued_by_turn ON jobs (priority DESC, turn, number, memory_bytes)
    WHERE state = 1;
  CREATE INDEX IF NOT EXISTS jobs_queued_by_due ON jobs (due_us, memory_bytes) WHERE state = 1;
  CREATE INDEX IF NOT EXISTS jobs_running_by_due ON jobs (due_us, memory_bytes) WHERE state = 2;
  CREATE INDEX IF NOT EXISTS jobs_unfinished_by_subject ON jobs (subject)
    WHERE state IN (1, 2, 6) AND parent IS NULL;
)sql";
constexpr int64_t kSqliteSchemaVersion = std::size(kSqliteMigrations);
constexpr int64_t kSqliteFirstWithOwners = 5;

absl::Status CheckIsCurrent(Database& db) {
  LB_ASSIGN_OR_RETURN(const int64_t version, QueryInt(db, "PRAGMA user_version"));
  return CheckTablesVersion(db, version, kSqliteSchemaVersion, kSqliteSchemaVersion);
}

absl::Status Migrate(Database& db) {
  LB_ASSIGN_OR_RETURN(const int64_t version, QueryInt(db, "PRAGMA user_version"));
  LB_ASSIGN_OR_RETURN(const int64_t application, QueryInt(db, "PRAGMA application_id"));
  LB_ASSIGN_OR_RETURN(const int64_t num_tables, QueryInt(db, "SELECT COUNT(*) FROM sqlite_schema"));
  const bool is_new = version == 0 && application == 0 && num_tables == 0;
  if (!is_new && application != kApplicationId) {
    return absl::FailedPreconditionError(
        absl::StrCat("database ", db.name(), " is not a liquidblend catalog"));
  }
  LB_RETURN_IF_ERROR(CheckTablesVersion(db, version, 0, kSqliteSchemaVersion));
  if (version == kSqliteSchemaVersion) return absl::OkStatus();
  for (int64_t k = version; k < kSqliteSchemaVersion; ++k) {
    LB_RETURN_IF_ERROR(db.RunScript(kSqliteMigrations[k]));
  }
  if (version < kSqliteFirstWithOwners) LB_RETURN_IF_ERROR(NoteOwners(db));
  return db.RunScript(absl::StrCat("PRAGMA application_id = ", kApplicationId,
                                   "; PRAGMA user_version = ", kSqliteSchemaVersion, ";"));
}

absl::Status MakeTables(Database& db) {
  LB_RETURN_IF_ERROR(Migrate(db));
  return db.RunScript(kSqliteAdditions);
}

absl::Status PrepareTables(Database& db) {
  LB_RETURN_IF_ERROR(db.Transaction([&] { return MakeTables(db); }));
  return db.Run("PRAGMA quick_check(1)", {}, [&](const SqlRow& row) {
    const std::string verdict = row.String(0);
    return verdict == "ok"
               ? absl::OkStatus()
               : absl::DataLossError(absl::StrCat("database ", db.name(), ": ", verdict));
  });
}

class SqliteBackend : public SqlBackend {
 public:
  explicit SqliteBackend(std::unique_ptr<Database> db) : db_(std::move(db)) {}

  absl::Status Read(Body body) override ABSL_LOCKS_EXCLUDED(mutex_) {
    const absl::MutexLock lock(&mutex_);
    return body(*db_);
  }

  absl::Status Change(Body body) override ABSL_LOCKS_EXCLUDED(mutex_) {
    const absl::MutexLock lock(&mutex_);
    Database& db = *db_;
    return db.Transaction([&]() -> absl::Status {
      LB_RETURN_IF_ERROR(CheckIsCurrent(db));
      return body(db);
    });
  }

  absl::Status ReadCurrent(Body body) override ABSL_LOCKS_EXCLUDED(mutex_) {
    const absl::MutexLock lock(&mutex_);
    LB_RETURN_IF_ERROR(CheckIsCurrent(*db_));
    LB_RETURN_IF_ERROR(body(*db_));
    return CheckIsCurrent(*db_);
  }

  // SQLite has one writer at a time in any case, and a catalog has one connection.
  absl::Status ReadSnapshot(Body body) override { return Change(body); }
  absl::Status ChangeShared(Body body) override { return Change(body); }
  absl::Status ChangeJob(Body body) override { return Change(body); }

  absl::StatusOr<bool> WaitForJob(absl::Duration timeout, UntilNextJob until_next) override {
    const base::SteadyClock::time_point begin = base::SteadyClock::now();
    while (true) {
      LB_ASSIGN_OR_RETURN(const absl::Duration pause, until_next());
      const bool found = pause <= absl::ZeroDuration();
      const absl::Duration left = timeout - base::Since(begin);
      if (found || left <= absl::ZeroDuration()) return found;
      absl::SleepFor(std::min(left, kPollInterval));
    }
  }

 private:
  absl::Mutex mutex_;
  const std::unique_ptr<Database> db_ ABSL_PT_GUARDED_BY(mutex_);
};

}  // namespace

int64_t SqliteTablesVersion() { return kSqliteSchemaVersion; }

absl::StatusOr<std::unique_ptr<Catalog>> OpenSqliteCatalog(const std::string& path,
                                                           const CatalogOptions& options) {
  LB_RETURN_IF_ERROR(options.Validate());
  const size_t slash = path.rfind('/');
  const std::string folder = slash == std::string::npos ? "." : path.substr(0, slash + 1);
  LB_RETURN_IF_ERROR(base::MakeDirectories(folder));
  LB_ASSIGN_OR_RETURN(std::unique_ptr<Database> db,
                      Database::Open(path, options.busy_timeout, options.now));
  LB_RETURN_IF_ERROR(PrepareTables(*db));
  LB_RETURN_IF_ERROR(base::SyncDirectory(folder));
  return MakeSqlCatalog(std::make_unique<SqliteBackend>(std::move(db)), options);
}

}  // namespace liquidblend::store
