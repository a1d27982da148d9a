#include "server/rpc/family_version.h"

#include "server/rpc/errors.h"

namespace liquidblend::rpc {

absl::StatusOr<store::pb::FamilyRecord> FindFamilyVersion(store::Catalog& catalog,
                                                          const std::string& id, int64_t version) {
  if (version < 0) return InvalidField("version", "must not be negative");
  return version == 0 ? catalog.GetFamily(id) : catalog.GetFamilyVersion(id, version);
}

}  // namespace liquidblend::rpc
