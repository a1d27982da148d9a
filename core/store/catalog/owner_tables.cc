#include "core/store/catalog/owner_tables.h"

#include <functional>
#include <map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/store/catalog/catalog_tables.h"

namespace liquidblend::store {
namespace {

using Uses = std::map<std::string, OwnerUse>;

// Runs a query of an owner and numbers.
absl::Status AddTo(Sql& sql, Uses& uses, absl::string_view statement,
                   const std::function<void(const SqlRow&, OwnerUse&)>& add) {
  return sql.Run(statement, {}, [&](const SqlRow& row) {
    OwnerUse& use = uses[row.String(0)];
    use.owner = row.String(0);
    add(row, use);
    return absl::OkStatus();
  });
}

// Owner of the last job that made each resource: "animations/x" -> owner.
absl::StatusOr<std::map<std::string, std::string>> FindMakers(Sql& sql) {
  std::map<std::string, std::string> makers;
  LB_RETURN_IF_ERROR(
      sql.Run("SELECT subject, owner FROM jobs WHERE state = $1 AND parent IS NULL ORDER BY number",
              {int64_t{pb::JobRecord::SUCCEEDED}}, [&](const SqlRow& row) {
                makers[row.String(0)] = row.String(1);
                return absl::OkStatus();
              }));
  return makers;
}

template <typename Record>
absl::StatusOr<std::vector<Record>> ReadOwnerless(Sql& sql, absl::string_view statement) {
  std::vector<Record> records;
  LB_RETURN_IF_ERROR(sql.Run(statement, {}, [&](const SqlRow& row) {
    Record record;
    if (record.ParseFromString(row.String(0))) records.push_back(std::move(record));
    return absl::OkStatus();
  }));
  return records;
}

}  // namespace

absl::StatusOr<OwnerUse> FindOwnerUse(Sql& sql, const std::string& owner) {
  OwnerUse use;
  use.owner = owner;
  LB_ASSIGN_OR_RETURN(
      const int64_t files,
      QueryInt(sql,
               "SELECT CAST(SUM(stored_bytes) AS BIGINT) FROM (SELECT blob, stored_bytes FROM "
               "animations WHERE owner = $1 AND blob <> '' UNION SELECT blob, stored_bytes FROM "
               "families WHERE owner = $1 AND blob <> '' UNION SELECT blob, stored_bytes FROM "
               "kept_versions WHERE owner = $1 AND blob <> '') AS files",
               {owner}));
  LB_ASSIGN_OR_RETURN(const int64_t uploads,
                      QueryInt(sql,
                               "SELECT CAST(SUM(stored_bytes) AS BIGINT) FROM animations WHERE "
                               "owner = $1 AND blob = ''",
                               {owner}));
  use.stored_bytes = files + uploads;
  LB_ASSIGN_OR_RETURN(use.num_queued_jobs,
                      QueryInt(sql,
                               "SELECT COUNT(*) FROM jobs WHERE owner = $1 AND state IN (1, 2, 6) "
                               "AND parent IS NULL",
                               {owner}));
  return use;
}

absl::StatusOr<std::vector<OwnerUse>> FindOwners(Sql& sql) {
  Uses uses;
  LB_RETURN_IF_ERROR(AddTo(
      sql, uses,
      "SELECT owner, CAST(SUM(stored_bytes) AS BIGINT) FROM (SELECT owner, blob, stored_bytes FROM "
      "animations WHERE blob <> '' UNION SELECT owner, blob, stored_bytes FROM families WHERE "
      "blob <> '' UNION SELECT owner, blob, stored_bytes FROM kept_versions WHERE blob <> '') AS "
      "files GROUP BY owner",
      [](const SqlRow& row, OwnerUse& use) { use.stored_bytes += row.Int(1); }));
  LB_RETURN_IF_ERROR(AddTo(
      sql, uses,
      "SELECT owner, COUNT(*), CAST(SUM(CASE blob WHEN '' THEN stored_bytes ELSE 0 END) AS BIGINT) "
      "FROM animations GROUP BY owner",
      [](const SqlRow& row, OwnerUse& use) {
        use.num_animations = row.Int(1);
        use.stored_bytes += row.Int(2);
      }));
  LB_RETURN_IF_ERROR(
      AddTo(sql, uses, "SELECT owner, COUNT(*) FROM families WHERE blob <> '' GROUP BY owner",
            [](const SqlRow& row, OwnerUse& use) { use.num_families = row.Int(1); }));
  LB_RETURN_IF_ERROR(
      AddTo(sql, uses,
            "SELECT owner, COUNT(*) FROM jobs WHERE state IN (1, 2, 6) AND parent IS NULL "
            "GROUP BY owner",
            [](const SqlRow& row, OwnerUse& use) { use.num_queued_jobs = row.Int(1); }));
  std::vector<OwnerUse> list;
  for (auto& [owner, use] : uses) list.push_back(std::move(use));
  return list;
}

absl::Status NoteOwners(Sql& sql) {
  LB_ASSIGN_OR_RETURN(auto makers, FindMakers(sql));
  LB_ASSIGN_OR_RETURN(std::vector<pb::AnimationRecord> animations,
                      ReadOwnerless<pb::AnimationRecord>(
                          sql, "SELECT record FROM animations WHERE owner = '' ORDER BY id"));
  for (pb::AnimationRecord& animation : animations) {
    animation.set_owner(makers[absl::StrCat("animations/", animation.id())]);
    LB_RETURN_IF_ERROR(SaveAnimation(sql, animation));
  }
  LB_ASSIGN_OR_RETURN(std::vector<pb::FamilyRecord> families,
                      ReadOwnerless<pb::FamilyRecord>(
                          sql, "SELECT record FROM families WHERE owner = '' ORDER BY id"));
  for (pb::FamilyRecord& family : families) {
    family.set_owner(makers[absl::StrCat("families/", family.id())]);
    LB_RETURN_IF_ERROR(SaveFamily(sql, family));
  }
  return absl::OkStatus();
}

}  // namespace liquidblend::store
