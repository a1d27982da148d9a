#include "core/store/sqlite_tables.h"

#include <iterator>
#include <limits>
#include <set>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/store/job_records.h"

namespace liquidblend::store {
namespace {

constexpr int64_t kApplicationId = 0x4c51424c;  // "LQBL"

// kMigrations[k] makes version k + 1 (PRAGMA user_version) out of version k. Never changed once
// released, only added to; docs/formats.md describes the newest.
constexpr const char* kMigrations[] = {R"sql(
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
)sql"};
constexpr int64_t kSchemaVersion = std::size(kMigrations);

absl::StatusOr<int64_t> QueryInt(Database& db, absl::string_view sql,
                                 std::initializer_list<SqlValue> values = {}) {
  int64_t result = 0;
  LB_RETURN_IF_ERROR(db.Run(sql, values, [&](const SqlRow& row) {
    result = row.Int(0);
    return absl::OkStatus();
  }));
  return result;
}

absl::Status Migrate(Database& db) {
  LB_ASSIGN_OR_RETURN(const int64_t version, QueryInt(db, "PRAGMA user_version"));
  LB_ASSIGN_OR_RETURN(const int64_t application, QueryInt(db, "PRAGMA application_id"));
  LB_ASSIGN_OR_RETURN(const int64_t num_tables, QueryInt(db, "SELECT COUNT(*) FROM sqlite_schema"));
  const bool is_new = version == 0 && application == 0 && num_tables == 0;
  if (!is_new && application != kApplicationId) {
    return absl::FailedPreconditionError(
        absl::StrCat("database ", db.path(), " is not a liquidblend catalog"));
  }
  if (version < 0 || version > kSchemaVersion) {
    return absl::FailedPreconditionError(
        absl::StrCat("database ", db.path(), " has schema version ", version,
                     "; this program knows 1 to ", kSchemaVersion));
  }
  if (version == kSchemaVersion) return absl::OkStatus();
  for (int64_t k = version; k < kSchemaVersion; ++k) {
    LB_RETURN_IF_ERROR(db.RunScript(kMigrations[k]));
  }
  return db.RunScript(absl::StrCat("PRAGMA application_id = ", kApplicationId,
                                   "; PRAGMA user_version = ", kSchemaVersion, ";"));
}

template <typename Record>
absl::StatusOr<Record> Parse(const Database& db, const std::string& what,
                             const std::string& bytes) {
  Record record;
  if (record.ParseFromString(bytes)) return record;
  return absl::DataLossError(
      absl::StrCat("database ", db.path(), ": the record of ", what, " cannot be read"));
}

// The first record that the query gives.
template <typename Record>
absl::StatusOr<Record> FindRecord(Database& db, absl::string_view sql, const std::string& what,
                                  const std::string& id) {
  const std::string name = absl::StrCat(what, " '", id, "'");
  absl::StatusOr<Record> found = absl::NotFoundError(absl::StrCat(name, " does not exist"));
  LB_RETURN_IF_ERROR(db.Run(sql, {id}, [&](const SqlRow& row) {
    found = Parse<Record>(db, name, row.String(0));
    return absl::OkStatus();
  }));
  return found;
}

// Columns record, lease_id, lease_expires_us.
constexpr char kSelectJob[] = "SELECT record, lease_id, lease_expires_us FROM jobs ";

absl::StatusOr<std::optional<JobRow>> FindJobRow(Database& db, const std::string& where,
                                                 const SqlValue& value) {
  std::optional<JobRow> found;
  LB_RETURN_IF_ERROR(
      db.Run(absl::StrCat(kSelectJob, where), {value}, [&](const SqlRow& row) -> absl::Status {
        LB_ASSIGN_OR_RETURN(pb::JobRecord record, Parse<pb::JobRecord>(db, "a job", row.String(0)));
        found = JobRow{std::move(record), row.String(1), row.Int(2)};
        return absl::OkStatus();
      }));
  return found;
}

// `sql` selects the column record.
absl::StatusOr<std::vector<pb::JobRecord>> FindJobRecords(Database& db, absl::string_view sql,
                                                          std::initializer_list<SqlValue> values) {
  std::vector<pb::JobRecord> jobs;
  LB_RETURN_IF_ERROR(db.Run(sql, values, [&](const SqlRow& row) -> absl::Status {
    LB_ASSIGN_OR_RETURN(pb::JobRecord job, Parse<pb::JobRecord>(db, "a job", row.String(0)));
    jobs.push_back(std::move(job));
    return absl::OkStatus();
  }));
  return jobs;
}

// `sql` selects (key, record) with the values (last key, limit).
template <typename Record>
absl::StatusOr<Page<Record>> PageOf(Database& db, absl::string_view sql, const std::string& list,
                                    const SqlValue& last_key, int page_size) {
  Page<Record> page;
  const int size = PageSize(page_size);
  std::string key;
  LB_RETURN_IF_ERROR(
      db.Run(sql, {last_key, int64_t{size} + 1}, [&](const SqlRow& row) -> absl::Status {
        if (page.records.size() == static_cast<size_t>(size)) {
          page.next_page_token = PageToken(list, key);
          return absl::OkStatus();
        }
        key = row.String(0);
        LB_ASSIGN_OR_RETURN(Record record, Parse<Record>(db, list, row.String(1)));
        page.records.push_back(std::move(record));
        return absl::OkStatus();
      }));
  return page;
}

SqlValue TextOrNull(const std::string& text) {
  return text.empty() ? SqlValue(nullptr) : SqlValue(text);
}

}  // namespace

absl::Status PrepareTables(Database& db) {
  LB_RETURN_IF_ERROR(db.Transaction([&] { return Migrate(db); }));
  return db.Run("PRAGMA quick_check(1)", {}, [&](const SqlRow& row) {
    const std::string verdict = row.String(0);
    return verdict == "ok"
               ? absl::OkStatus()
               : absl::DataLossError(absl::StrCat("database ", db.path(), ": ", verdict));
  });
}

absl::StatusOr<pb::AnimationRecord> FindAnimation(Database& db, const std::string& id) {
  return FindRecord<pb::AnimationRecord>(db, "SELECT record FROM animations WHERE id = ?",
                                         "animation", id);
}

absl::StatusOr<pb::FamilyRecord> FindFamily(Database& db, const std::string& id) {
  return FindRecord<pb::FamilyRecord>(db, "SELECT record FROM families WHERE id = ?", "family", id);
}

absl::StatusOr<JobRow> FindJob(Database& db, const std::string& id) {
  LB_ASSIGN_OR_RETURN(std::optional<JobRow> row,
                      FindJobRow(db, "WHERE id = ? AND parent IS NULL", id));
  if (row.has_value()) return *std::move(row);
  return absl::NotFoundError(absl::StrCat("job '", id, "' does not exist"));
}

absl::StatusOr<JobRow> FindLeasedJob(Database& db, const std::string& lease_id) {
  LB_ASSIGN_OR_RETURN(std::optional<JobRow> row, FindJobRow(db, "WHERE lease_id = ?", lease_id));
  if (row.has_value()) return *std::move(row);
  return absl::AbortedError(
      absl::StrCat("lease '", lease_id, "' is gone: its job is done or was given to someone else"));
}

absl::StatusOr<std::optional<JobRow>> FindJobToDo(Database& db, int64_t now_us) {
  return FindJobRow(db,
                    absl::StrCat("WHERE state = ", static_cast<int>(pb::JobRecord::QUEUED),
                                 " OR (state = ", static_cast<int>(pb::JobRecord::RUNNING),
                                 " AND lease_expires_us <= ?) ORDER BY number LIMIT 1"),
                    now_us);
}

absl::StatusOr<std::optional<pb::JobRecord>> FindRequest(Database& db,
                                                         const std::string& request_id) {
  LB_ASSIGN_OR_RETURN(std::optional<JobRow> row,
                      FindJobRow(db, "WHERE request_id = ?", request_id));
  if (!row.has_value()) return std::optional<pb::JobRecord>();
  return std::move(row->record);
}

absl::StatusOr<std::vector<pb::JobRecord>> FindParts(Database& db, const std::string& parent) {
  return FindJobRecords(db, "SELECT record FROM jobs WHERE parent = ? ORDER BY number", {parent});
}

absl::StatusOr<std::vector<pb::JobRecord>> FindUnfinishedJobs(Database& db) {
  return FindJobRecords(
      db, "SELECT record FROM jobs WHERE state IN (?, ?, ?) AND parent IS NULL ORDER BY number",
      {int64_t{pb::JobRecord::QUEUED}, int64_t{pb::JobRecord::RUNNING},
       int64_t{pb::JobRecord::WAITING}});
}

absl::StatusOr<std::string> FindFamilyWith(Database& db, const std::string& animation) {
  std::string family;
  LB_RETURN_IF_ERROR(
      db.Run("SELECT family FROM family_members WHERE animation = ? ORDER BY family LIMIT 1",
             {animation}, [&](const SqlRow& row) {
               family = row.String(0);
               return absl::OkStatus();
             }));
  return family;
}

absl::Status SaveAnimation(Database& db, const pb::AnimationRecord& animation) {
  LB_ASSIGN_OR_RETURN(std::string bytes,
                      Serialize(animation, absl::StrCat("animation '", animation.id(), "'")));
  return db.Run(
      "INSERT OR REPLACE INTO animations (id, state, blob, record) VALUES (?, ?, ?, ?)",
      {animation.id(), int64_t{animation.state()}, animation.blob(), Bytes{std::move(bytes)}});
}

absl::Status SaveFamily(Database& db, const pb::FamilyRecord& family) {
  LB_ASSIGN_OR_RETURN(std::string bytes,
                      Serialize(family, absl::StrCat("family '", family.id(), "'")));
  return db.Run("INSERT OR REPLACE INTO families (id, version, blob, record) VALUES (?, ?, ?, ?)",
                {family.id(), family.version(), family.blob(), Bytes{std::move(bytes)}});
}

absl::Status SetFamilyMembers(Database& db, const std::string& family,
                              const std::vector<std::string>& animations) {
  LB_RETURN_IF_ERROR(db.Run("DELETE FROM family_members WHERE family = ?", {family}));
  for (const std::string& animation : animations) {
    LB_RETURN_IF_ERROR(
        db.Run("INSERT OR IGNORE INTO family_members (family, animation) VALUES (?, ?)",
               {family, animation}));
  }
  return absl::OkStatus();
}

absl::StatusOr<int64_t> TakeFamilyVersion(Database& db, const std::string& family) {
  return QueryInt(db,
                  "INSERT INTO family_versions (family, last_version) VALUES (?, 1) "
                  "ON CONFLICT (family) DO UPDATE SET last_version = last_version + 1 "
                  "RETURNING last_version",
                  {family});
}

absl::Status InsertJob(Database& db, const pb::JobRecord& job) {
  LB_ASSIGN_OR_RETURN(std::string bytes, Serialize(job, absl::StrCat("job '", job.id(), "'")));
  return db.Run(
      "INSERT INTO jobs (id, state, subject, request_id, parent, record) VALUES (?, ?, ?, ?, ?, ?)",
      {job.id(), int64_t{job.state()}, SubjectOf(job), TextOrNull(job.request_id()),
       TextOrNull(job.parent()), Bytes{std::move(bytes)}});
}

absl::Status UpdateJob(Database& db, const JobRow& job) {
  LB_ASSIGN_OR_RETURN(std::string bytes,
                      Serialize(job.record, absl::StrCat("job '", job.record.id(), "'")));
  const bool leased = !job.lease_id.empty();
  return db.Run(
      "UPDATE jobs SET state = ?, lease_id = ?, lease_expires_us = ?, record = ? WHERE id = ?",
      {int64_t{job.record.state()}, TextOrNull(job.lease_id),
       leased ? SqlValue(job.lease_expires_us) : SqlValue(nullptr), Bytes{std::move(bytes)},
       job.record.id()});
}

absl::Status RemoveAnimation(Database& db, const std::string& id) {
  return db.Run("DELETE FROM animations WHERE id = ?", {id});
}

absl::Status RemoveFamily(Database& db, const std::string& id) {
  LB_RETURN_IF_ERROR(SetFamilyMembers(db, id, {}));
  return db.Run("DELETE FROM families WHERE id = ?", {id});
}

absl::Status RemoveJob(Database& db, const std::string& id) {
  return db.Run("DELETE FROM jobs WHERE id = ?", {id});
}

absl::Status RemoveParts(Database& db, const std::string& parent) {
  return db.Run("DELETE FROM jobs WHERE parent = ?", {parent});
}

absl::StatusOr<Page<pb::AnimationRecord>> PageOfAnimations(Database& db, int page_size,
                                                           const std::string& token) {
  LB_ASSIGN_OR_RETURN(const std::string last, LastKey("animations", token));
  return PageOf<pb::AnimationRecord>(
      db, "SELECT id, record FROM animations WHERE id > ? ORDER BY id LIMIT ?", "animations", last,
      page_size);
}

absl::StatusOr<Page<pb::FamilyRecord>> PageOfFamilies(Database& db, int page_size,
                                                      const std::string& token) {
  LB_ASSIGN_OR_RETURN(const std::string last, LastKey("families", token));
  return PageOf<pb::FamilyRecord>(
      db, "SELECT id, record FROM families WHERE id > ? ORDER BY id LIMIT ?", "families", last,
      page_size);
}

absl::StatusOr<Page<pb::JobRecord>> PageOfJobs(Database& db, int page_size,
                                               const std::string& token) {
  LB_ASSIGN_OR_RETURN(const std::string last, LastKey("jobs", token));
  int64_t before = std::numeric_limits<int64_t>::max();
  if (!last.empty() && !absl::SimpleAtoi(last, &before)) {
    return absl::InvalidArgumentError(absl::StrCat("page token '", token, "' is damaged"));
  }
  return PageOf<pb::JobRecord>(
      db,
      "SELECT number, record FROM jobs WHERE parent IS NULL AND number < ? ORDER BY number DESC "
      "LIMIT ?",
      "jobs", before, page_size);
}

absl::StatusOr<std::vector<std::string>> BlobsInUse(Database& db) {
  std::set<std::string> blobs;
  LB_RETURN_IF_ERROR(
      db.Run("SELECT blob FROM animations WHERE blob <> '' UNION SELECT blob FROM families WHERE "
             "blob <> ''",
             {}, [&](const SqlRow& row) {
               blobs.insert(row.String(0));
               return absl::OkStatus();
             }));
  LB_ASSIGN_OR_RETURN(const std::vector<pb::JobRecord> jobs, FindUnfinishedJobs(db));
  for (const pb::JobRecord& job : jobs) {
    for (const pb::SourceFile& file : job.import_animation().files()) blobs.insert(file.blob());
  }
  LB_ASSIGN_OR_RETURN(const std::vector<pb::JobRecord> parts,
                      FindJobRecords(db, "SELECT record FROM jobs WHERE parent IS NOT NULL", {}));
  for (const pb::JobRecord& part : parts) {
    if (!part.result_blob().empty()) blobs.insert(part.result_blob());
  }
  return std::vector<std::string>(blobs.begin(), blobs.end());
}

}  // namespace liquidblend::store
