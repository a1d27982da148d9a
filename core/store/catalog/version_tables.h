// The versions of families that are kept beside the published one (docs/formats.md, "The catalog").
// Each function runs inside a transaction of its caller.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "core/store/catalog/catalog.h"
#include "core/store/sql/sql.h"

namespace liquidblend::store {

// Finds the published version or a kept one.
// Errors: kNotFound if there is no such family or version, naming the versions that exist.
absl::StatusOr<pb::FamilyRecord> FindVersion(Sql& sql, const std::string& id, int64_t version);

// Find the versions that are kept beside the published ones: of one family, newest first; of all
// families, by family and version; or their numbers alone.
absl::StatusOr<std::vector<pb::FamilyRecord>> FindKeptVersions(Sql& sql, const std::string& id);
absl::StatusOr<std::vector<pb::FamilyRecord>> FindAllKeptVersions(Sql& sql);
absl::StatusOr<KeptVersions> ListKeptNumbers(Sql& sql);

// Inserts the row of a kept version.
absl::Status SaveKeptVersion(Sql& sql, const pb::FamilyRecord& family);
// Removes all kept versions of a family.
absl::Status RemoveKeptVersions(Sql& sql, const std::string& id);

// Publishes `next` as the newest version of `published`, which is kept if it has a version. Keeps
// `keep_versions` versions, the new one included. Sets the number and times of `next`, and returns
// it.
//   animations  of `next`: they are needed as long as the version is published or kept
absl::StatusOr<pb::FamilyRecord> PublishVersion(Sql& sql, const pb::FamilyRecord& published,
                                                pb::FamilyRecord next,
                                                std::vector<std::string> animations,
                                                int keep_versions, absl::Time now);

// Publishes a kept version again, with a number of its own; does nothing if the published one is
// that version again already.
// Errors: FindVersion()'s; kFailedPrecondition if it is the published one.
absl::StatusOr<pb::FamilyRecord> RollbackFamily(Sql& sql, const std::string& id, int64_t version,
                                                int keep_versions, absl::Time now);

}  // namespace liquidblend::store
