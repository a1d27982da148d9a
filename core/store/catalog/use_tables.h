// The catalog's table of uses: how many frames of a family were asked for, by day. Each function
// runs inside a transaction of its caller.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "core/store/catalog/catalog.h"
#include "core/store/sql/sql.h"

namespace liquidblend::store {

// See Catalog::RecordFamilyUses() and Catalog::ListMostUsedFamilies().
absl::Status AddFamilyUses(Sql& sql, const std::map<std::string, int64_t>& num_frames,
                           absl::Time now);
absl::StatusOr<std::vector<UsedFamily>> FindMostUsedFamilies(Sql& sql, int max_num, absl::Time now);
absl::Status RemoveFamilyUses(Sql& sql, const std::string& family);

}  // namespace liquidblend::store
