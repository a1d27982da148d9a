// Use of the store by each owner, counted in the catalog's tables.
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/store/catalog/catalog.h"
#include "core/store/sql/sql.h"

namespace liquidblend::store {

// The use of one owner, without the numbers of animations and families.  Cost: O(what the owner
// has), in indices.
absl::StatusOr<OwnerUse> FindOwnerUse(Sql& sql, const std::string& owner);

// See Catalog::ListOwners().
absl::StatusOr<std::vector<OwnerUse>> FindOwners(Sql& sql);

// Sets the owner of animations and families without one to the owner of the last job that made
// them, if the history has it. Unreadable records are skipped.
absl::Status NoteOwners(Sql& sql);

}  // namespace liquidblend::store
