// The blobs that the catalog's tables refer to.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/store/sql/sql.h"

namespace liquidblend::store {

// The blobs of Catalog::ListReferencedBlobs(), in any order, some of them several times. Runs
// inside a snapshot of its caller. Animations, families and kept versions are read in pages, so
// that no statement of a large catalog comes to the time limit of statements; unfinished jobs are
// not.
absl::StatusOr<std::vector<std::string>> BlobsInUse(Sql& sql);
// Sorts them, and keeps each once. To be called after the snapshot: with a million of them it may
// take longer than a transaction may be idle.
std::vector<std::string> SortedOnce(std::vector<std::string> blobs);

}  // namespace liquidblend::store
