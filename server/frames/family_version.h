// Records of families by the version that a request names.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "core/store/catalog/catalog.h"

namespace liquidblend::server {

// The family as it is published, or, unless version is 0, as it was in that one.
// Errors: kInvalidArgument (version), kNotFound naming the versions that there are, the catalog's.
absl::StatusOr<store::pb::FamilyRecord> FindFamilyVersion(store::Catalog& catalog,
                                                          const std::string& id, int64_t version);

}  // namespace liquidblend::server
