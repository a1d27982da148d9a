// What each owner has, counted in the catalog's tables.
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/store/catalog/catalog.h"
#include "core/store/sql/sql.h"

namespace liquidblend::store {

// Without the numbers of animations and families.  Cost: O(what the owner has), in indices.
absl::StatusOr<OwnerUse> FindOwnerUse(Sql& sql, const std::string& owner);

// See Catalog::ListOwners().
absl::StatusOr<std::vector<OwnerUse>> FindOwners(Sql& sql);

// Gives animations and families that have no owner the one of the last job that made them, as far
// as the history tells. Records that cannot be read are passed over.
absl::Status NoteOwners(Sql& sql);

}  // namespace liquidblend::store
