// The catalog's upkeep (catalog_upkeep.h) but for inspections, in any database. Each function runs
// inside a transaction of its caller, ListFamilyVersions() and ListUnfinishedJobs() need none.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/store/catalog/catalog_upkeep.h"
#include "core/store/sql/sql.h"

namespace liquidblend::store {

// See CatalogUpkeep::Id().
absl::StatusOr<std::string> FindCatalogId(Sql& sql);
// See CatalogUpkeep for these.
absl::StatusOr<std::map<std::string, int64_t>> ListFamilyVersions(Sql& sql);
absl::StatusOr<std::vector<HeldJob>> ListUnfinishedJobs(Sql& sql);
// See CatalogUpkeep::CheckImport(), Import() and SetAnimationReadable().
absl::Status CheckNoClash(Sql& sql, const CatalogContents& contents);
absl::Status ImportContents(Sql& sql, const CatalogContents& contents);
absl::Status SetAnimationReadable(Sql& sql, const std::string& id, const std::string& blob,
                                  const absl::Status& readable);

}  // namespace liquidblend::store
