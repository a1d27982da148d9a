#include "core/store/catalog/catalog_tables.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/store/catalog/job_records.h"
#include "core/store/catalog/record_parts.h"
#include "core/store/catalog/use_tables.h"
#include "core/store/catalog/version_tables.h"

namespace liquidblend::store {
namespace {

template <typename Record>
absl::StatusOr<Record> Parse(const Sql& sql, const std::string& what, const std::string& bytes) {
  Record record;
  if (record.ParseFromString(bytes)) return record;
  return absl::DataLossError(
      absl::StrCat("database ", sql.name(), ": the record of ", what, " cannot be read"));
}

// Finds a record by its id.
template <typename Record>
absl::StatusOr<Record> FindRecord(Sql& sql, absl::string_view statement, const std::string& what,
                                  const std::string& id) {
  const std::string name = absl::StrCat(what, " '", id, "'");
  absl::StatusOr<Record> found = absl::NotFoundError(absl::StrCat(name, " does not exist"));
  LB_RETURN_IF_ERROR(sql.Run(statement, {id}, [&](const SqlRow& row) {
    found = Parse<Record>(sql, name, row.String(0));
    return absl::OkStatus();
  }));
  return found;
}

// Reads a page of records. Rows of `rows` are (key, record), a key for each.
template <typename Record, typename Key>
absl::StatusOr<Page<Record>> PageOf(Sql& sql, const RecordRows& rows, const std::string& list,
                                    const Key& before, int page_size) {
  Page<Record> page;
  const auto size = static_cast<size_t>(PageSize(page_size));
  LB_ASSIGN_OR_RETURN(const std::vector<RecordLength<Key>> lengths,
                      ReadLengths(sql, rows, before, static_cast<int64_t>(size) + 1));
  if (lengths.empty()) return page;
  const size_t end = EndOfPart(lengths, 0, size);
  const Key& last = lengths[end - 1].key;
  bool has_more = end < lengths.size();
  const auto add = [&](const SqlRow& row) -> absl::Status {
    has_more = has_more || page.records.size() == size;  // rows that have come meanwhile
    if (page.records.size() == size) return absl::OkStatus();
    LB_ASSIGN_OR_RETURN(Record record, Parse<Record>(sql, list, row.String(1)));
    page.records.push_back(std::move(record));
    page.tokens.push_back(PageToken(list, row.String(0)));
    return absl::OkStatus();
  };
  LB_RETURN_IF_ERROR(sql.Run(rows.records, {before, last}, add));
  // If no row is left of those that were there, the next page begins after them.
  if (has_more) {
    page.next_page_token =
        page.tokens.empty() ? PageToken(list, absl::StrCat(last)) : page.tokens.back();
  }
  return page;
}

// What follows "FROM jobs" to find unfinished jobs, not children, by their subject.
std::string Unfinished(const Sql& sql) {
  return absl::StrCat(sql.indexed_by("jobs_unfinished_by_subject"),
                      " WHERE state IN (1, 2, 6) AND parent IS NULL");
}

SqlValue DueOf(const JobRow& job) {
  const pb::JobRecord::State state = job.record.state();
  const bool is_in_queue = state == pb::JobRecord::QUEUED || state == pb::JobRecord::RUNNING;
  return is_in_queue ? SqlValue(job.due_us) : SqlValue(nullptr);
}

// The value of the column ended_us. Children have none: they are deleted with their job.
SqlValue EndOf(const pb::JobRecord& job) {
  if (IsUnfinished(job) || !job.parent().empty()) return nullptr;
  const google::protobuf::Timestamp& end = job.update_time();
  return int64_t{end.seconds()} * 1'000'000 + end.nanos() / 1000;
}

// Bytes that the animation counts for its owner: its file, or during the import the uploaded files.
int64_t StoredBytes(const pb::AnimationRecord& animation) {
  if (!animation.blob().empty()) return animation.size_bytes();
  return animation.state() == pb::AnimationRecord::IMPORTING ? animation.upload_bytes() : 0;
}

SqlValue TextOrNull(const std::string& text) {
  return text.empty() ? SqlValue(nullptr) : SqlValue(text);
}

}  // namespace

absl::StatusOr<pb::JobRecord> ParseJob(const Sql& sql, const std::string& bytes) {
  return Parse<pb::JobRecord>(sql, "a job", bytes);
}

absl::StatusOr<std::optional<JobRow>> FindJobRow(Sql& sql, const std::string& where,
                                                 std::initializer_list<SqlValue> values) {
  std::optional<JobRow> found;
  LB_RETURN_IF_ERROR(
      sql.Run(absl::StrCat("SELECT record, lease_id, due_us, number FROM jobs ", where), values,
              [&](const SqlRow& row) -> absl::Status {
                LB_ASSIGN_OR_RETURN(pb::JobRecord record, ParseJob(sql, row.String(0)));
                found = JobRow{std::move(record), row.String(1), row.Int(2), row.Int(3)};
                return absl::OkStatus();
              }));
  return found;
}

absl::StatusOr<pb::AnimationRecord> FindAnimation(Sql& sql, const std::string& id) {
  return FindRecord<pb::AnimationRecord>(sql, "SELECT record FROM animations WHERE id = $1",
                                         "animation", id);
}

absl::StatusOr<pb::FamilyRecord> FindFamily(Sql& sql, const std::string& id) {
  return FindRecord<pb::FamilyRecord>(sql, "SELECT record FROM families WHERE id = $1", "family",
                                      id);
}

absl::StatusOr<JobRow> FindJob(Sql& sql, const std::string& id) {
  LB_ASSIGN_OR_RETURN(
      std::optional<JobRow> row,
      FindJobRow(sql, absl::StrCat("WHERE id = $1 AND parent IS NULL", sql.for_update()), {id}));
  if (row.has_value()) return *std::move(row);
  return absl::NotFoundError(absl::StrCat("job '", id, "' does not exist"));
}

absl::StatusOr<JobRow> FindLeasedJob(Sql& sql, const std::string& lease_id) {
  LB_ASSIGN_OR_RETURN(
      std::optional<JobRow> row,
      FindJobRow(sql, absl::StrCat("WHERE lease_id = $1", sql.for_update()), {lease_id}));
  if (row.has_value()) return *std::move(row);
  return absl::AbortedError(absl::StrCat(
      "lease '", lease_id, "' has ended: its job is done or was leased by another worker"));
}

absl::StatusOr<std::optional<pb::JobRecord>> FindRequest(Sql& sql, const std::string& request_id) {
  LB_ASSIGN_OR_RETURN(std::optional<JobRow> row,
                      FindJobRow(sql, "WHERE request_id = $1", {request_id}));
  if (!row.has_value()) return std::optional<pb::JobRecord>();
  return std::move(row->record);
}

absl::StatusOr<std::vector<pb::JobRecord>> FindChildren(Sql& sql, const std::string& parent) {
  std::vector<pb::JobRecord> children;
  const auto add = [&](const SqlRow& row) -> absl::Status {
    LB_ASSIGN_OR_RETURN(children.emplace_back(), ParseJob(sql, row.String(0)));
    return absl::OkStatus();
  };
  LB_RETURN_IF_ERROR(
      sql.Run("SELECT record FROM jobs WHERE parent = $1 ORDER BY number", {parent}, add));
  return children;
}

absl::StatusOr<std::string> FindUnfinishedJobOf(Sql& sql, const std::string& subject) {
  std::string id;
  LB_RETURN_IF_ERROR(
      sql.Run(absl::StrCat("SELECT id FROM jobs ", Unfinished(sql), " AND subject = $1"), {subject},
              [&](const SqlRow& row) {
                id = row.String(0);
                return absl::OkStatus();
              }));
  return id;
}

absl::StatusOr<std::string> FindUnfinishedRegistrationWith(Sql& sql, const std::string& animation) {
  const std::string unfinished = Unfinished(sql);
  // '0' is the character after '/'.
  const RecordRows rows = {absl::StrCat("SELECT subject, length(record) FROM jobs ", unfinished,
                                        " AND subject > $1 AND subject < 'families0' "
                                        "ORDER BY subject LIMIT $2"),
                           absl::StrCat("SELECT subject, record FROM jobs ", unfinished,
                                        " AND subject > $1 AND subject <= $2 ORDER BY subject")};
  std::string found;
  const auto look = [&](const SqlRow& row) -> absl::Status {
    LB_ASSIGN_OR_RETURN(const pb::JobRecord job, ParseJob(sql, row.String(1)));
    const std::vector<std::string> ids = AnimationsOf(job);
    if (std::count(ids.begin(), ids.end(), animation) == 0) return absl::OkStatus();
    found = job.id();
    return absl::CancelledError("found");  // so that no more are read
  };
  const absl::Status read = ReadInParts(sql, rows, std::string("families/"), look);
  if (found.empty()) LB_RETURN_IF_ERROR(read);
  return found;
}

absl::StatusOr<JobCounts> CountJobsByState(Sql& sql) {
  JobCounts counts;
  LB_RETURN_IF_ERROR(
      sql.Run("SELECT state, COUNT(*) FROM jobs GROUP BY state", {}, [&](const SqlRow& row) {
        counts[static_cast<pb::JobRecord::State>(row.Int(0))] = row.Int(1);
        return absl::OkStatus();
      }));
  return counts;
}

absl::StatusOr<JobMemoryCounts> CountUnfinishedByMemory(Sql& sql) {
  JobMemoryCounts counts;
  const std::string query =
      absl::StrCat("SELECT state, (memory_bytes - 1) / ", int64_t{1} << 30,
                   " + 1, COUNT(*) FROM jobs WHERE state IN (", pb::JobRecord::QUEUED, ", ",
                   pb::JobRecord::RUNNING, ") GROUP BY 1, 2");
  LB_RETURN_IF_ERROR(sql.Run(query, {}, [&](const SqlRow& row) {
    counts[{static_cast<pb::JobRecord::State>(row.Int(0)), row.Int(1)}] = row.Int(2);
    return absl::OkStatus();
  }));
  return counts;
}

absl::StatusOr<std::string> FindFamilyWith(Sql& sql, const std::string& animation) {
  std::string family;
  LB_RETURN_IF_ERROR(
      sql.Run("SELECT family FROM family_members WHERE animation = $1 ORDER BY family LIMIT 1",
              {animation}, [&](const SqlRow& row) {
                family = row.String(0);
                return absl::OkStatus();
              }));
  return family;
}

absl::Status SaveAnimation(Sql& sql, const pb::AnimationRecord& animation) {
  LB_ASSIGN_OR_RETURN(std::string bytes,
                      Serialize(animation, absl::StrCat("animation '", animation.id(), "'")));
  return sql.Run(
      "INSERT INTO animations (id, state, blob, owner, stored_bytes, record) "
      "VALUES ($1, $2, $3, $4, $5, $6) ON CONFLICT (id) DO UPDATE SET state = excluded.state, "
      "blob = excluded.blob, owner = excluded.owner, stored_bytes = excluded.stored_bytes, "
      "record = excluded.record",
      {animation.id(), int64_t{animation.state()}, animation.blob(), animation.owner(),
       StoredBytes(animation), Bytes{std::move(bytes)}});
}

absl::Status SaveFamily(Sql& sql, const pb::FamilyRecord& family) {
  LB_ASSIGN_OR_RETURN(std::string bytes,
                      Serialize(family, absl::StrCat("family '", family.id(), "'")));
  return sql.Run(
      "INSERT INTO families (id, version, blob, owner, stored_bytes, record) "
      "VALUES ($1, $2, $3, $4, $5, $6) ON CONFLICT (id) DO UPDATE SET version = excluded.version, "
      "blob = excluded.blob, owner = excluded.owner, stored_bytes = excluded.stored_bytes, "
      "record = excluded.record",
      {family.id(), family.version(), family.blob(), family.owner(),
       family.blob().empty() ? int64_t{0} : int64_t{family.size_bytes()}, Bytes{std::move(bytes)}});
}

absl::Status SetFamilyMembers(Sql& sql, const std::string& family,
                              const std::vector<std::string>& animations) {
  LB_RETURN_IF_ERROR(sql.Run("DELETE FROM family_members WHERE family = $1", {family}));
  for (const std::string& animation : animations) {
    LB_RETURN_IF_ERROR(sql.Run(
        "INSERT INTO family_members (family, animation) VALUES ($1, $2) ON CONFLICT DO NOTHING",
        {family, animation}));
  }
  return absl::OkStatus();
}

absl::StatusOr<int64_t> TakeFamilyVersion(Sql& sql, const std::string& family) {
  return QueryInt(
      sql,
      "INSERT INTO family_versions (family, last_version) VALUES ($1, 1) "
      "ON CONFLICT (family) DO UPDATE SET last_version = family_versions.last_version + 1 "
      "RETURNING last_version",
      {family});
}

absl::Status InsertJob(Sql& sql, const pb::JobRecord& job) {
  LB_ASSIGN_OR_RETURN(std::string bytes, Serialize(job, absl::StrCat("job '", job.id(), "'")));
  return sql.Run(
      "INSERT INTO jobs (id, state, subject, request_id, parent, due_us, owner, priority, turn, "
      "memory_bytes, ended_us, record) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12)",
      {job.id(), int64_t{job.state()}, SubjectOf(job), TextOrNull(job.request_id()),
       TextOrNull(job.parent()), DueOf({job, "", 0}), job.owner(), int64_t{job.priority()},
       job.turn(), job.memory_bytes(), EndOf(job), Bytes{std::move(bytes)}});
}

absl::Status UpdateJob(Sql& sql, const JobRow& job) {
  LB_ASSIGN_OR_RETURN(std::string bytes,
                      Serialize(job.record, absl::StrCat("job '", job.record.id(), "'")));
  return sql.Run(
      "UPDATE jobs SET state = $1, lease_id = $2, due_us = $3, attempts = $4, ended_us = $5, "
      "record = $6 WHERE id = $7",
      {int64_t{job.record.state()}, TextOrNull(job.lease_id), DueOf(job),
       int64_t{job.record.attempts()}, EndOf(job.record), Bytes{std::move(bytes)},
       job.record.id()});
}

absl::Status RemoveAnimation(Sql& sql, const std::string& id) {
  return sql.Run("DELETE FROM animations WHERE id = $1", {id});
}

absl::Status RemoveFamily(Sql& sql, const std::string& id) {
  LB_RETURN_IF_ERROR(SetFamilyMembers(sql, id, {}));
  LB_RETURN_IF_ERROR(RemoveKeptVersions(sql, id));
  LB_RETURN_IF_ERROR(RemoveFamilyUses(sql, id));
  return sql.Run("DELETE FROM families WHERE id = $1", {id});
}

absl::Status RemoveJob(Sql& sql, const std::string& id) {
  return sql.Run("DELETE FROM jobs WHERE id = $1", {id});
}

absl::StatusOr<int64_t> CountHistory(Sql& sql, absl::Time end) {
  return QueryInt(sql, "SELECT COUNT(*) FROM jobs WHERE ended_us < $1", {absl::ToUnixMicros(end)});
}

absl::StatusOr<int64_t> RemoveHistory(Sql& sql, absl::Time end, int64_t max_num) {
  int64_t num_removed = 0;
  LB_RETURN_IF_ERROR(
      sql.Run("DELETE FROM jobs WHERE number IN (SELECT number FROM jobs WHERE ended_us < $1 "
              "ORDER BY ended_us LIMIT $2) RETURNING number",
              {absl::ToUnixMicros(end), max_num}, [&](const SqlRow&) {
                ++num_removed;
                return absl::OkStatus();
              }));
  return num_removed;
}

absl::Status RemoveChildren(Sql& sql, const std::string& parent) {
  return sql.Run("DELETE FROM jobs WHERE parent = $1", {parent});
}

absl::StatusOr<Page<pb::AnimationRecord>> PageOfAnimations(Sql& sql, int page_size,
                                                           const std::string& token) {
  LB_ASSIGN_OR_RETURN(const std::string last, LastKey("animations", token));
  const RecordRows rows = {
      "SELECT id, length(record) FROM animations WHERE id > $1 ORDER BY id LIMIT $2",
      "SELECT id, record FROM animations WHERE id > $1 AND id <= $2 ORDER BY id"};
  return PageOf<pb::AnimationRecord>(sql, rows, "animations", last, page_size);
}

absl::StatusOr<Page<pb::FamilyRecord>> PageOfFamilies(Sql& sql, int page_size,
                                                      const std::string& token) {
  LB_ASSIGN_OR_RETURN(const std::string last, LastKey("families", token));
  const RecordRows rows = {
      "SELECT id, length(record) FROM families WHERE id > $1 ORDER BY id LIMIT $2",
      "SELECT id, record FROM families WHERE id > $1 AND id <= $2 ORDER BY id"};
  return PageOf<pb::FamilyRecord>(sql, rows, "families", last, page_size);
}

absl::StatusOr<Page<pb::JobRecord>> PageOfJobs(Sql& sql, int page_size, const std::string& token) {
  LB_ASSIGN_OR_RETURN(const std::string last, LastKey("jobs", token));
  int64_t before = std::numeric_limits<int64_t>::max();
  if (!last.empty() && !absl::SimpleAtoi(last, &before)) {
    return absl::InvalidArgumentError(absl::StrCat("page token '", token, "' is damaged"));
  }
  const RecordRows rows = {
      "SELECT number, length(record) FROM jobs WHERE parent IS NULL AND number < $1 "
      "ORDER BY number DESC LIMIT $2",
      "SELECT number, record FROM jobs WHERE parent IS NULL AND number < $1 AND number >= $2 "
      "ORDER BY number DESC"};
  return PageOf<pb::JobRecord>(sql, rows, "jobs", before, page_size);
}

}  // namespace liquidblend::store
