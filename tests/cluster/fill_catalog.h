// A catalog in PostgreSQL with many animations and families, whose blobs do not exist.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/status.h"

namespace liquidblend::bench {

// Adds `num_blobs` records with a blob each: of ten, nine animations and a family of two of them.
// Does nothing if the catalog has records.
// Requires: the catalog's tables are there.  Errors: the database's.
absl::Status FillCatalog(const std::string& url, int64_t num_blobs);

}  // namespace liquidblend::bench
