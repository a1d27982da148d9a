#include "core/store/catalog/upkeep_tables.h"

#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/store/catalog/catalog_tables.h"
#include "core/store/catalog/job_records.h"
#include "core/store/catalog/owner_tables.h"
#include "core/store/catalog/record_parts.h"
#include "core/store/catalog/version_tables.h"

namespace liquidblend::store {
namespace {

using Names = std::set<std::string>;

absl::StatusOr<Names> ReadNames(Sql& sql, absl::string_view statement) {
  Names names;
  LB_RETURN_IF_ERROR(sql.Run(statement, {}, [&](const SqlRow& row) {
    names.insert(row.String(0));
    return absl::OkStatus();
  }));
  return names;
}

absl::Status Add(const std::string& what, const std::string& name, Names& names) {
  if (names.insert(name).second) return absl::OkStatus();
  return absl::AlreadyExistsError(absl::StrCat(what, " '", name, "' is there already"));
}

}  // namespace

absl::StatusOr<std::string> FindCatalogId(Sql& sql) {
  std::string id;
  const absl::Status found = sql.Run("SELECT id FROM catalog_id", {}, [&](const SqlRow& row) {
    id = row.String(0);
    return absl::OkStatus();
  });
  if (found.ok() && !id.empty()) return id;
  if (!found.ok() && !absl::IsInternal(found)) return found;  // without the table it is internal
  return absl::FailedPreconditionError(
      absl::StrCat("database ", sql.name(),
                   " has no id: start a program of this version as a user who may create tables; ",
                   found.message()));
}

absl::StatusOr<std::map<std::string, int64_t>> ListFamilyVersions(Sql& sql) {
  std::map<std::string, int64_t> versions;
  LB_RETURN_IF_ERROR(sql.Run("SELECT id, version FROM families", {}, [&](const SqlRow& row) {
    versions[row.String(0)] = row.Int(1);
    return absl::OkStatus();
  }));
  return versions;
}

absl::StatusOr<std::vector<HeldJob>> ListUnfinishedJobs(Sql& sql) {
  const RecordRows rows = {
      "SELECT number, length(record) FROM jobs WHERE state IN (1, 2, 6) AND "
      "number > $1 ORDER BY number LIMIT $2",
      "SELECT number, id, record, due_us FROM jobs WHERE state IN (1, 2, 6) "
      "AND number > $1 AND number <= $2 ORDER BY number"};
  std::vector<HeldJob> jobs;
  const auto add = [&](const SqlRow& row) {
    HeldJob held;
    if (!held.job.ParseFromString(row.String(2))) {
      return absl::DataLossError(absl::StrCat("database ", sql.name(), ": the record of job '",
                                              row.String(1), "' cannot be read"));
    }
    DropLists(held.job);
    if (held.job.state() == pb::JobRecord::RUNNING) {
      held.lease_expires = absl::FromUnixMicros(row.Int(3));
    }
    jobs.push_back(std::move(held));
    return absl::OkStatus();
  };
  LB_RETURN_IF_ERROR(ReadInParts(sql, rows, int64_t{0}, add));
  return jobs;
}

// Every name must be new to the catalog, and occur only once in the contents.
absl::Status CheckNoClash(Sql& sql, const CatalogContents& contents) {
  LB_ASSIGN_OR_RETURN(Names animations, ReadNames(sql, "SELECT id FROM animations"));
  for (const pb::AnimationRecord& animation : contents.animations) {
    LB_RETURN_IF_ERROR(Add("animation", animation.id(), animations));
  }
  // The name of a deleted family counts as taken, since its versions were given out here.
  LB_ASSIGN_OR_RETURN(Names families, ReadNames(sql,
                                                "SELECT id FROM families UNION "
                                                "SELECT family FROM family_versions"));
  for (const pb::FamilyRecord& family : contents.families) {
    LB_RETURN_IF_ERROR(Add("family (or one that was deleted)", family.id(), families));
  }
  LB_ASSIGN_OR_RETURN(Names jobs, ReadNames(sql, "SELECT id FROM jobs"));
  LB_ASSIGN_OR_RETURN(Names requests,
                      ReadNames(sql, "SELECT request_id FROM jobs WHERE request_id IS NOT NULL"));
  for (const pb::JobRecord& job : contents.jobs) {
    LB_RETURN_IF_ERROR(Add("job", job.id(), jobs));
    if (job.request_id().empty()) continue;
    LB_RETURN_IF_ERROR(Add("request_id", job.request_id(), requests));
  }
  return absl::OkStatus();
}

absl::Status ImportContents(Sql& sql, const CatalogContents& contents) {
  LB_RETURN_IF_ERROR(CheckNoClash(sql, contents));
  for (const pb::AnimationRecord& animation : contents.animations) {
    LB_RETURN_IF_ERROR(SaveAnimation(sql, animation));
  }
  for (const pb::FamilyRecord& family : contents.families) {
    LB_RETURN_IF_ERROR(SaveFamily(sql, family));
  }
  for (const pb::FamilyRecord& kept : contents.kept_versions) {
    LB_RETURN_IF_ERROR(SaveKeptVersion(sql, kept));
  }
  std::map<std::string, std::vector<std::string>> members;
  for (const pb::FamilyMember& member : contents.members) {
    members[member.family()].push_back(member.animation());
  }
  for (const auto& [family, animations] : members) {
    LB_RETURN_IF_ERROR(SetFamilyMembers(sql, family, animations));
  }
  for (const pb::FamilyVersion& version : contents.versions) {
    LB_RETURN_IF_ERROR(
        sql.Run("INSERT INTO family_versions (family, last_version) VALUES ($1, $2) "
                "ON CONFLICT (family) DO UPDATE SET last_version = excluded.last_version "
                "WHERE excluded.last_version > family_versions.last_version",
                {version.family(), int64_t{version.last_version()}}));
  }
  for (const pb::JobRecord& job : contents.jobs) LB_RETURN_IF_ERROR(InsertJob(sql, job));
  return NoteOwners(sql);  // of records that an older program wrote
}

absl::Status SetAnimationReadable(Sql& sql, const std::string& id, const std::string& blob,
                                  const absl::Status& readable) {
  LB_ASSIGN_OR_RETURN(pb::AnimationRecord animation, FindAnimation(sql, id));
  if (animation.blob() != blob) return absl::OkStatus();
  const auto needed = readable.ok() ? pb::AnimationRecord::FAILED : pb::AnimationRecord::READY;
  if (animation.state() != needed) return absl::OkStatus();
  animation.set_state(readable.ok() ? pb::AnimationRecord::READY : pb::AnimationRecord::FAILED);
  animation.clear_error();
  if (!readable.ok()) *animation.mutable_error() = ToRpcStatus(readable);
  return SaveAnimation(sql, animation);
}

}  // namespace liquidblend::store
