// The blobs that the catalog's tables refer to.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/store/sql/sql.h"

namespace liquidblend::store {

// The blobs of Catalog::ListReferencedBlobs(), in any order, some of them several times. Needs no
// snapshot: a blob that is referred to from the beginning to the end is among them, also if the
// reference moves meanwhile. Reads pages, so that no statement of a large catalog comes to the time
// limit of statements, nor keeps deleted rows of the queue from being removed.
absl::StatusOr<std::vector<std::string>> BlobsInUse(Sql& sql);
// Sorts them, and keeps each once. To be called outside of a transaction: with a million of them it
// may take longer than one may be idle.
std::vector<std::string> SortedOnce(std::vector<std::string> blobs);

}  // namespace liquidblend::store
