#include "core/store/catalog/inspection.h"

#include <map>
#include <set>
#include <utility>

#include "absl/functional/function_ref.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/store/catalog/blob_tables.h"
#include "core/store/catalog/job_records.h"
#include "core/store/catalog/record_parts.h"

namespace liquidblend::store {
namespace {

using Ids = std::set<std::string>;

// ---- Reading

// Rows are (id, number, blob, record).
absl::Status ReadResources(Sql& sql, const RecordRows& rows,
                           std::vector<CatalogRows::Resource>& resources) {
  return ReadInParts(sql, rows, std::string(), [&](const SqlRow& row) {
    resources.push_back({row.String(0), row.Int(1), row.String(2), row.String(3)});
    return absl::OkStatus();
  });
}

absl::Status ReadJobs(Sql& sql, std::vector<CatalogRows::Job>& jobs) {
  const RecordRows rows = {
      "SELECT number, length(record) FROM jobs WHERE number > $1 ORDER BY number LIMIT $2",
      "SELECT number, id, state, subject, request_id, parent, record FROM jobs "
      "WHERE number > $1 AND number <= $2 ORDER BY number"};
  return ReadInParts(sql, rows, int64_t{0}, [&](const SqlRow& row) {
    jobs.push_back(
        {row.String(1), row.Int(2), row.String(3), row.String(4), row.String(5), row.String(6)});
    return absl::OkStatus();
  });
}

absl::Status ReadMembersAndVersions(Sql& sql, CatalogRows& rows) {
  LB_RETURN_IF_ERROR(
      sql.Run("SELECT family, animation FROM family_members ORDER BY family, animation", {},
              [&](const SqlRow& row) {
                pb::FamilyMember& member = rows.members.emplace_back();
                member.set_family(row.String(0));
                member.set_animation(row.String(1));
                return absl::OkStatus();
              }));
  return sql.Run("SELECT family, last_version FROM family_versions ORDER BY family", {},
                 [&](const SqlRow& row) {
                   pb::FamilyVersion& version = rows.versions.emplace_back();
                   version.set_family(row.String(0));
                   version.set_last_version(row.Int(1));
                   return absl::OkStatus();
                 });
}

// ---- Looking

template <typename Rows>
Ids IdsOf(const Rows& rows) {
  Ids ids;
  for (const auto& row : rows) ids.insert(row.id);
  return ids;
}

// Parses a record, and compares it with its columns. Adds to `damage` if it cannot be read or
// differs, else to `records`. Frees the bytes.
template <typename Record>
void ParseRow(const std::string& what, std::string& bytes,
              absl::FunctionRef<bool(const Record&)> agrees, std::vector<Record>& records,
              std::vector<std::string>& damage) {
  Record record;
  const bool is_read = record.ParseFromString(std::exchange(bytes, {}));
  if (!is_read) return damage.push_back(absl::StrCat("the record of ", what, " cannot be read"));
  if (agrees(record)) return records.push_back(std::move(record));
  damage.push_back(absl::StrCat("the record of ", what, " contradicts the columns of its row"));
}

void InspectAnimations(std::vector<CatalogRows::Resource>& rows, CatalogInspection& result) {
  for (CatalogRows::Resource& row : rows) {
    const auto agrees = [&](const pb::AnimationRecord& record) {
      return record.id() == row.id && record.state() == row.number && record.blob() == row.blob;
    };
    ParseRow<pb::AnimationRecord>(absl::StrCat("animation '", row.id, "'"), row.record, agrees,
                                  result.contents.animations, result.damage);
  }
}

void InspectVersions(std::vector<CatalogRows::Resource>& rows, bool are_kept,
                     std::vector<pb::FamilyRecord>& records, CatalogInspection& result) {
  for (CatalogRows::Resource& row : rows) {
    const auto agrees = [&](const pb::FamilyRecord& record) {
      return record.id() == row.id && record.version() == row.number && record.blob() == row.blob;
    };
    const std::string version = are_kept ? absl::StrCat("version ", row.number, " of ") : "";
    ParseRow<pb::FamilyRecord>(absl::StrCat(version, "family '", row.id, "'"), row.record, agrees,
                               records, result.damage);
  }
}

void InspectJobs(std::vector<CatalogRows::Job>& rows, CatalogInspection& result) {
  for (CatalogRows::Job& row : rows) {
    const auto agrees = [&](const pb::JobRecord& record) {
      return record.id() == row.id && record.state() == row.state &&
             SubjectOf(record) == row.subject && record.request_id() == row.request_id &&
             record.parent() == row.parent;
    };
    ParseRow<pb::JobRecord>(absl::StrCat("job '", row.id, "'"), row.record, agrees,
                            result.contents.jobs, result.damage);
  }
}

void AddBlobs(const CatalogRows& rows, CatalogInspection& result) {
  for (const auto* resources : {&rows.animations, &rows.families, &rows.kept_versions}) {
    for (const CatalogRows::Resource& row : *resources) {
      if (!row.blob.empty()) result.blobs.push_back(row.blob);
    }
  }
  for (const pb::JobRecord& job : result.contents.jobs) {
    if (IsUnfinished(job) || !job.parent().empty()) AddBlobsOf(job, result.blobs);
  }
}

// Checks the references of rows to rows of other tables.
void InspectReferences(const CatalogRows& rows, CatalogInspection& result) {
  const Ids animations = IdsOf(rows.animations), families = IdsOf(rows.families);
  const Ids jobs = IdsOf(rows.jobs);
  for (const pb::FamilyMember& member : result.contents.members) {
    if (animations.contains(member.animation()) && families.contains(member.family())) continue;
    result.damage.push_back(absl::StrCat("family '", member.family(), "' has animation '",
                                         member.animation(), "', but not both are there"));
  }
  for (const pb::JobRecord& job : result.contents.jobs) {
    if (job.parent().empty() || jobs.contains(job.parent())) continue;
    result.damage.push_back(absl::StrCat("job '", job.id(), "' is a child of '", job.parent(),
                                         "', which is not there"));
  }
  for (const pb::FamilyRecord& kept : result.contents.kept_versions) {
    if (families.contains(kept.id())) continue;
    result.damage.push_back(absl::StrCat("version ", kept.version(), " of family '", kept.id(),
                                         "' is kept, but the family is not there"));
  }
  std::map<std::string, int64_t> last;
  for (const pb::FamilyVersion& row : result.contents.versions) {
    last[row.family()] = row.last_version();
  }
  for (const pb::FamilyRecord& family : result.contents.families) {
    if (family.version() <= last[family.id()]) continue;
    result.damage.push_back(absl::StrCat("family '", family.id(), "' has version ",
                                         family.version(), ", but the last one given is ",
                                         last[family.id()]));
  }
}

}  // namespace

absl::StatusOr<CatalogRows> ReadRows(Sql& sql) {
  CatalogRows rows;
  LB_RETURN_IF_ERROR(ReadResources(
      sql,
      {"SELECT id, length(record) FROM animations WHERE id > $1 ORDER BY id LIMIT $2",
       "SELECT id, state, blob, record FROM animations WHERE id > $1 AND id <= $2 ORDER BY id"},
      rows.animations));
  LB_RETURN_IF_ERROR(ReadResources(
      sql,
      {"SELECT id, length(record) FROM families WHERE id > $1 ORDER BY id LIMIT $2",
       "SELECT id, version, blob, record FROM families WHERE id > $1 AND id <= $2 ORDER BY id"},
      rows.families));
  LB_RETURN_IF_ERROR(ReadResources(
      sql,
      {"SELECT family, length(record) FROM kept_versions WHERE family > $1 "
       "ORDER BY family LIMIT $2",
       "SELECT family, version, blob, record FROM kept_versions WHERE family > $1 AND "
       "family <= $2 ORDER BY family, version"},
      rows.kept_versions));
  LB_RETURN_IF_ERROR(ReadJobs(sql, rows.jobs));
  LB_RETURN_IF_ERROR(ReadMembersAndVersions(sql, rows));
  return rows;
}

CatalogInspection InspectRows(CatalogRows rows) {
  CatalogInspection result;
  InspectAnimations(rows.animations, result);
  InspectVersions(rows.families, /*are_kept=*/false, result.contents.families, result);
  InspectVersions(rows.kept_versions, /*are_kept=*/true, result.contents.kept_versions, result);
  InspectJobs(rows.jobs, result);
  result.contents.members = std::move(rows.members);
  result.contents.versions = std::move(rows.versions);
  InspectReferences(rows, result);
  AddBlobs(rows, result);
  return result;
}

}  // namespace liquidblend::store
