// Inspection of a catalog (CatalogUpkeep::Inspect()), in any database. Its rows are read as they
// are, in one snapshot, and looked at when that has ended: PostgreSQL keeps all rows that were
// replaced or deleted for as long as it lasts.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/store/catalog/catalog_upkeep.h"
#include "core/store/sql/sql.h"

namespace liquidblend::store {

// All rows of a catalog, with the columns that a record must agree with.
struct CatalogRows {
  struct Resource {  // an animation, a family or a kept version
    std::string id;
    int64_t number = 0;  // state of an animation, version of a family
    std::string blob;
    std::string record;
  };
  struct Job {
    std::string id;
    int64_t state = 0;
    std::string subject, request_id, parent;
    std::string record;
  };
  std::vector<Resource> animations, families, kept_versions;
  std::vector<Job> jobs;
  std::vector<pb::FamilyMember> members;
  std::vector<pb::FamilyVersion> versions;
};

// Reads the rows, records in parts of bounded size. To be called in a snapshot.
absl::StatusOr<CatalogRows> ReadRows(Sql& sql);

// Parses and compares them. The blobs are in any order, some of them several times.
CatalogInspection InspectRows(CatalogRows rows);

}  // namespace liquidblend::store
