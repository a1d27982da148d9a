// Records of families by the version that a request names.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "core/store/catalog/catalog.h"

namespace liquidblend::server {

// The record of the published version, or of `version` unless it is 0.
// Errors: kInvalidArgument (version), kNotFound naming the versions that exist, and the catalog's.
absl::StatusOr<store::pb::FamilyRecord> FindFamilyVersion(store::Catalog& catalog,
                                                          const std::string& id, int64_t version);

}  // namespace liquidblend::server
