// The blobs that the catalog's tables refer to.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/store/sql/sql.h"

namespace liquidblend::store {

// See Catalog::ListReferencedBlobs(). Runs inside a snapshot of its caller. A catalog of any size
// is read in pages, so that no statement comes to the time limit of statements.
absl::StatusOr<std::vector<std::string>> BlobsInUse(Sql& sql);

}  // namespace liquidblend::store
