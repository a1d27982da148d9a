// The blobs that the catalog's tables refer to.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/store/catalog/catalog.h"
#include "core/store/sql/sql.h"

namespace liquidblend::store {

// The blobs of Catalog::ListReferencedBlobs(), in any order, some of them several times. Reads
// pages without a snapshot: so no statement of a large catalog comes to the time limit of
// statements, or keeps old rows of the queue from being removed.
absl::StatusOr<std::vector<std::string>> BlobsInUse(Sql& sql);
// Adds the blobs that an unfinished job, or a child, refers to.
void AddBlobsOf(const pb::JobRecord& job, std::vector<std::string>& blobs);
// Sorts them, and keeps each once. To be called outside of a transaction: with a million of them it
// may take longer than one may be idle.
std::vector<std::string> SortedOnce(std::vector<std::string> blobs);

}  // namespace liquidblend::store
