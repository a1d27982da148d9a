#include "core/store/catalog/version_tables.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/base/status_macros.h"
#include "core/store/catalog/catalog_tables.h"
#include "core/store/catalog/job_records.h"

namespace liquidblend::store {
namespace {

absl::StatusOr<std::vector<pb::FamilyRecord>> ReadRecords(Sql& sql, absl::string_view statement,
                                                          std::initializer_list<SqlValue> values) {
  std::vector<pb::FamilyRecord> records;
  LB_RETURN_IF_ERROR(sql.Run(statement, values, [&](const SqlRow& row) {
    if (records.emplace_back().ParseFromString(row.String(0))) return absl::OkStatus();
    return absl::DataLossError(
        absl::StrCat("database ", sql.name(), ": the record of a kept version cannot be read"));
  }));
  return records;
}

absl::Status NoSuchVersion(const pb::FamilyRecord& published,
                           const std::vector<pb::FamilyRecord>& kept, int64_t version) {
  std::vector<int64_t> numbers;
  for (const pb::FamilyRecord& record : kept) numbers.push_back(record.version());
  return absl::NotFoundError(absl::StrCat(
      "family '", published.id(), "' has no version ", version, "; the published one is ",
      published.version(),
      numbers.empty() ? ", and no other is kept"
                      : absl::StrCat(", and kept are ", absl::StrJoin(numbers, ", "))));
}

std::vector<std::string> AnimationsOf(const pb::FamilyRecord& family) {
  const pb::FamilyManifest& manifest = family.manifest();
  std::vector<std::string> ids(manifest.targets().begin(), manifest.targets().end());
  if (!manifest.source().empty()) ids.push_back(manifest.source());
  return ids;
}

absl::Status DropOldVersions(Sql& sql, const std::string& id, int num_kept) {
  return sql.Run(
      "DELETE FROM kept_versions WHERE family = $1 AND version NOT IN (SELECT version FROM "
      "kept_versions WHERE family = $1 ORDER BY version DESC LIMIT $2)",
      {id, int64_t{num_kept}});
}

}  // namespace

absl::StatusOr<pb::FamilyRecord> FindVersion(Sql& sql, const std::string& id, int64_t version) {
  LB_ASSIGN_OR_RETURN(pb::FamilyRecord published, FindFamily(sql, id));
  if (version > 0 && version == published.version()) return published;
  LB_ASSIGN_OR_RETURN(std::vector<pb::FamilyRecord> kept, FindKeptVersions(sql, id));
  for (pb::FamilyRecord& record : kept) {
    if (record.version() == version) return std::move(record);
  }
  return NoSuchVersion(published, kept, version);
}

absl::StatusOr<std::vector<pb::FamilyRecord>> FindKeptVersions(Sql& sql, const std::string& id) {
  return ReadRecords(
      sql, "SELECT record FROM kept_versions WHERE family = $1 ORDER BY version DESC", {id});
}

absl::StatusOr<std::vector<pb::FamilyRecord>> FindAllKeptVersions(Sql& sql) {
  return ReadRecords(sql, "SELECT record FROM kept_versions ORDER BY family, version", {});
}

absl::StatusOr<KeptVersions> ListKeptNumbers(Sql& sql) {
  KeptVersions numbers;
  LB_RETURN_IF_ERROR(
      sql.Run("SELECT family, version FROM kept_versions", {}, [&](const SqlRow& row) {
        numbers[row.String(0)].insert(row.Int(1));
        return absl::OkStatus();
      }));
  return numbers;
}

absl::Status SaveKeptVersion(Sql& sql, const pb::FamilyRecord& family) {
  LB_ASSIGN_OR_RETURN(std::string bytes,
                      Serialize(family, absl::StrCat("family '", family.id(), "'")));
  return sql.Run(
      "INSERT INTO kept_versions (family, version, blob, owner, stored_bytes, record) "
      "VALUES ($1, $2, $3, $4, $5, $6)",
      {family.id(), family.version(), family.blob(), family.owner(),
       family.blob().empty() ? int64_t{0} : int64_t{family.size_bytes()}, Bytes{std::move(bytes)}});
}

absl::Status RemoveKeptVersions(Sql& sql, const std::string& id) {
  return sql.Run("DELETE FROM kept_versions WHERE family = $1", {id});
}

absl::StatusOr<pb::FamilyRecord> PublishVersion(Sql& sql, const pb::FamilyRecord& published,
                                                pb::FamilyRecord next,
                                                std::vector<std::string> animations,
                                                int keep_versions, absl::Time now) {
  LB_ASSIGN_OR_RETURN(const int64_t version, TakeFamilyVersion(sql, published.id()));
  if (published.version() > 0) LB_RETURN_IF_ERROR(SaveKeptVersion(sql, published));
  LB_RETURN_IF_ERROR(DropOldVersions(sql, published.id(), std::max(keep_versions, 1) - 1));
  next.set_version(version);
  next.mutable_manifest()->set_version(version);
  *next.mutable_create_time() = published.create_time();
  *next.mutable_update_time() = ToTimestamp(now);
  next.clear_failed_registration();
  LB_RETURN_IF_ERROR(SaveFamily(sql, next));
  LB_ASSIGN_OR_RETURN(const std::vector<pb::FamilyRecord> kept,
                      FindKeptVersions(sql, published.id()));
  for (const pb::FamilyRecord& record : kept) {
    for (std::string& id : AnimationsOf(record)) animations.push_back(std::move(id));
  }
  LB_RETURN_IF_ERROR(SetFamilyMembers(sql, published.id(), animations));
  return next;
}

absl::StatusOr<pb::FamilyRecord> RollbackFamily(Sql& sql, const std::string& id, int64_t version,
                                                int keep_versions, absl::Time now) {
  LB_ASSIGN_OR_RETURN(const pb::FamilyRecord published, FindFamily(sql, id));
  if (version > 0 && published.restored_version() == version) return published;
  LB_ASSIGN_OR_RETURN(pb::FamilyRecord earlier, FindVersion(sql, id, version));
  if (version == published.version()) {
    return absl::FailedPreconditionError(
        absl::StrCat("version ", version, " of family '", id, "' is the published one"));
  }
  earlier.set_restored_version(version);
  std::vector<std::string> animations = AnimationsOf(earlier);
  return PublishVersion(sql, published, std::move(earlier), std::move(animations), keep_versions,
                        now);
}

}  // namespace liquidblend::store
