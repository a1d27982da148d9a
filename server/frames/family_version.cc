#include "server/frames/family_version.h"

#include "server/base/errors.h"

namespace liquidblend::server {

absl::StatusOr<store::pb::FamilyRecord> FindFamilyVersion(store::Catalog& catalog,
                                                          const std::string& id, int64_t version) {
  if (version < 0) return InvalidField("version", "must not be negative");
  return version == 0 ? catalog.GetFamily(id) : catalog.GetFamilyVersion(id, version);
}

}  // namespace liquidblend::server
