// Catalogs as former versions of the program made them: their statements, word by word.
#pragma once

#include <string>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "tests/core/store/catalog/catalog_testing.h"

namespace liquidblend::store {

inline constexpr char kSqliteVersion1[] = R"sql(
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
  PRAGMA application_id = 0x4c51424c;
  PRAGMA user_version = 1;
)sql";

// After version 1.
inline constexpr char kSqliteVersion2[] = R"sql(
  ALTER TABLE jobs ADD COLUMN parent TEXT;
  CREATE INDEX jobs_by_parent ON jobs (parent, number);
  PRAGMA user_version = 2;
)sql";

// After version 2.
inline constexpr char kSqliteVersion3[] = R"sql(
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
  PRAGMA user_version = 3;
)sql";

inline constexpr char kPostgresVersion1[] = R"sql(
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
  UPDATE catalog_version SET version = 1, changed_at = now();
)sql";

// After version 1.
inline constexpr char kPostgresVersion2[] = R"sql(
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
  UPDATE catalog_version SET version = 2, changed_at = now();
)sql";

// After version 3.
inline constexpr char kSqliteVersion4[] = R"sql(
  ALTER TABLE jobs ADD COLUMN ended_us INTEGER;
  UPDATE jobs SET ended_us = CAST(strftime('%s', 'now') AS INTEGER) * 1000000
    WHERE state IN (3, 4, 5) AND parent IS NULL;
  CREATE INDEX jobs_by_end ON jobs (ended_us) WHERE ended_us IS NOT NULL;
  PRAGMA user_version = 4;
)sql";

// After version 2.
inline constexpr char kPostgresVersion3[] = R"sql(
  ALTER TABLE jobs ADD COLUMN ended_us BIGINT;
  UPDATE jobs SET ended_us = (extract(epoch FROM clock_timestamp()) * 1000000)::bigint
    WHERE state IN (3, 4, 5) AND parent IS NULL;
  CREATE INDEX jobs_by_end ON jobs (ended_us) WHERE ended_us IS NOT NULL;
  UPDATE catalog_version SET version = 3, changed_at = now();
)sql";

// After version 4.
inline constexpr char kSqliteVersion5[] = R"sql(
  ALTER TABLE animations ADD COLUMN owner TEXT NOT NULL DEFAULT '';
  ALTER TABLE animations ADD COLUMN stored_bytes INTEGER NOT NULL DEFAULT 0;
  ALTER TABLE families ADD COLUMN owner TEXT NOT NULL DEFAULT '';
  ALTER TABLE families ADD COLUMN stored_bytes INTEGER NOT NULL DEFAULT 0;
  CREATE INDEX animations_by_owner ON animations (owner, blob, stored_bytes);
  CREATE INDEX families_by_owner ON families (owner, blob, stored_bytes);
  PRAGMA user_version = 5;
)sql";

// After version 3.
inline constexpr char kPostgresVersion4[] = R"sql(
  ALTER TABLE animations ADD COLUMN owner TEXT COLLATE "C" NOT NULL DEFAULT '';
  ALTER TABLE animations ADD COLUMN stored_bytes BIGINT NOT NULL DEFAULT 0;
  ALTER TABLE families ADD COLUMN owner TEXT COLLATE "C" NOT NULL DEFAULT '';
  ALTER TABLE families ADD COLUMN stored_bytes BIGINT NOT NULL DEFAULT 0;
  CREATE INDEX animations_by_owner ON animations (owner, blob, stored_bytes);
  CREATE INDEX families_by_owner ON families (owner, blob, stored_bytes);
  UPDATE catalog_version SET version = 4, changed_at = now();
)sql";

// After version 5.
inline constexpr char kSqliteVersion6[] = R"sql(
  ALTER TABLE workers ADD COLUMN refusal TEXT NOT NULL DEFAULT '';
  PRAGMA user_version = 6;
)sql";

// After version 4.
inline constexpr char kPostgresVersion5[] = R"sql(
  ALTER TABLE workers ADD COLUMN refusal TEXT NOT NULL DEFAULT '';
  UPDATE catalog_version SET version = 5, changed_at = now();
)sql";

// ---- what is in them; CheckOldRows() says whether a catalog still has it

inline pb::JobRecord OldJob(const std::string& id, pb::JobRecord job, pb::JobRecord::State state) {
  job.set_id(id);
  job.set_state(state);
  if (state == pb::JobRecord::RUNNING) {
    job.set_attempts(1);
    job.set_worker("old worker");
  }
  return job;
}

// A statement that inserts the job. `literal` writes bytes as the database reads them.
template <typename Literal>
std::string InsertOldJob(const pb::JobRecord& job, const std::string& subject,
                         const std::string& lease, const Literal& literal) {
  const std::string request =
      job.request_id().empty() ? "NULL" : absl::StrCat("'", job.request_id(), "'");
  return absl::StrCat(
      "INSERT INTO jobs (id, state, subject, request_id, lease_id, "
      "lease_expires_us, record) VALUES ('",
      job.id(), "', ", job.state(), ", '", subject, "', ", request, ", ", lease, ", ",
      literal(job.SerializeAsString()), ");\n");
}

// Two animations, a family, and jobs: done, queued, running until kOldLeaseEnd, and queued for two
// targets (without children, as the oldest programs did it).
inline constexpr int64_t kOldLeaseEnd = 1700000000;
template <typename Literal>
std::string FillOldCatalog(const Literal& literal) {
  using Job = pb::JobRecord;
  std::string script;
  for (const std::string id : {"a", "b"}) {
    pb::AnimationRecord animation = AnimationCalled(id);
    animation.set_state(pb::AnimationRecord::READY);
    animation.set_blob("blob-of-" + id);
    animation.set_size_bytes(100);
    absl::StrAppend(&script, "INSERT INTO animations (id, state, blob, record) VALUES ('", id,
                    "', 2, 'blob-of-", id, "', ", literal(animation.SerializeAsString()), ");\n");
  }
  pb::FamilyRecord family;
  family.set_id("f");
  family.set_version(3);
  family.set_blob("blob-of-f");
  absl::StrAppend(
      &script, "INSERT INTO families (id, version, blob, record) VALUES ('f', 3, 'blob-of-f', ",
      literal(family.SerializeAsString()),
      ");\nINSERT INTO family_members VALUES ('f', 'a');\n"
      "INSERT INTO family_versions VALUES ('f', 3);\n",
      InsertOldJob(OldJob("import-a", ImportOf("a", "request"), Job::SUCCEEDED), "animations/a",
                   "NULL, NULL", literal),
      InsertOldJob(OldJob("register-f", RegistrationOf("f", "a", {"b"}), Job::RUNNING),
                   "families/f", absl::StrCat("'lease', ", kOldLeaseEnd, "000000"), literal),
      InsertOldJob(OldJob("register-g", RegistrationOf("g", "a", {"a", "b"}), Job::QUEUED),
                   "families/g", "NULL, NULL", literal));
  return script;
}

// After OldRows(), from when jobs had owners: whose the first one was.
inline constexpr char kOwnerOfOldJob[] = "UPDATE jobs SET owner = 'ann' WHERE id = 'import-a';";

// A catalog whose clock stands at `now`, and that has been brought up to date.
inline void CheckOldRows(Catalog& catalog, absl::Time& now, bool with_owners = false) {
  now = absl::FromUnixSeconds(kOldLeaseEnd) - absl::Seconds(1);
  EXPECT_EQ(catalog.GetAnimation("a")->blob(), "blob-of-a");
  const auto owners = catalog.ListOwners();
  ASSERT_THAT(owners, Succeeds());
  ASSERT_EQ(owners->size(), with_owners ? 2 : 1);
  EXPECT_EQ(owners->front().stored_bytes, with_owners ? 100 : 200);
  EXPECT_EQ(owners->back().owner, with_owners ? "ann" : "");
  EXPECT_EQ(owners->back().stored_bytes, with_owners ? 100 : 200);
  EXPECT_EQ(catalog.GetFamily("f")->version(), 3);
  EXPECT_EQ(catalog.ListJobs(0, "")->records.size(), 3);
  EXPECT_THAT(catalog.DeleteAnimation("a"), Fails(absl::StatusCode::kFailedPrecondition, "'f'"));
  EXPECT_EQ(catalog.SubmitImport(AnimationCalled("a"), ImportOf("a", "request"))->id(), "import-a");
  const auto next = [&] {
    const auto lease = catalog.LeaseJob("worker", absl::Minutes(1));
    return lease.ok() && lease->has_value() ? (*lease)->job.id() : "";
  };
  EXPECT_EQ(next(), "register-g");  // the other one is leased
  EXPECT_EQ(next(), "");
  EXPECT_TRUE(catalog.ListChildren("register-g")->empty());
  EXPECT_THAT(catalog.Heartbeat("lease", absl::Seconds(1), {}), Succeeds());
  now += absl::Seconds(1);
  EXPECT_EQ(next(), "register-f");
  EXPECT_THAT(catalog.Heartbeat("lease", absl::Seconds(1), {}),
              Fails(absl::StatusCode::kAborted, "'lease'"));
  EXPECT_THAT(catalog.SubmitImport(AnimationCalled("c"), ImportOf("c")), Succeeds());
  // To the history, what had ended by then ended when the catalog was brought up to date.
  const auto prune = [&](absl::Time at) {
    now = at;
    return *catalog.PruneHistory({.keep = absl::Hours(24)});
  };
  EXPECT_EQ(prune(absl::Now() + absl::Hours(23)), 0);
  EXPECT_EQ(prune(absl::Now() + absl::Hours(25)), 1);
  EXPECT_THAT(catalog.GetJob("import-a"), Fails(absl::StatusCode::kNotFound, "import-a"));
}

// A catalog of OldRows() that kept one version of each family: from now on it keeps two.
inline void CheckOldVersionIsKept(Catalog& catalog) {
  for (const std::string id : {"register-f", "register-g"}) {
    ASSERT_THAT(catalog.RequestCancel(id), Succeeds());
  }
  EXPECT_TRUE(catalog.ListKeptVersions("f")->empty());
  pb::JobRecord job = RegistrationOf("f", "a", {"b"});
  job.mutable_register_family()->set_keep_versions(2);
  ASSERT_THAT(catalog.SubmitRegistration(job), Succeeds());
  const auto lease = catalog.LeaseJob("worker", absl::Minutes(1));
  ASSERT_THAT(lease, Succeeds());
  ASSERT_TRUE(lease->has_value());
  pb::FamilyRecord family;
  family.set_id("f");
  family.set_blob("blob 4");
  EXPECT_EQ(*catalog.PublishFamily((*lease)->lease_id, family), 4);
  EXPECT_EQ(catalog.GetFamilyVersion("f", 3)->blob(), "blob-of-f");
  EXPECT_THAT(*catalog.ListReferencedBlobs(), ::testing::Contains("blob-of-f"));
  EXPECT_EQ(catalog.RollbackFamily("f", 3, 2)->version(), 5);
  EXPECT_EQ(catalog.GetFamily("f")->blob(), "blob-of-f");
}

}  // namespace liquidblend::store
