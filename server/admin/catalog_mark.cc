#include "server/admin/catalog_mark.h"

#include <string>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace liquidblend::admin {
namespace {

constexpr char kAdvice[] =
    "; nothing is deleted. Check --data, or --store and --blobs; if they are right, `liquidblend-"
    "admin collect --adopt` makes the blobs this catalog's";

}  // namespace

absl::Status CheckMark(store::Catalog& catalog, store::BlobStore& blobs,
                       const MarkOptions& options) {
  LB_ASSIGN_OR_RETURN(const std::string id, catalog.Id());
  LB_ASSIGN_OR_RETURN(const std::string mark, blobs.ReadCatalogId());
  if (mark == id) return absl::OkStatus();
  if (!options.is_forced && !mark.empty()) {
    return absl::FailedPreconditionError(
        absl::StrCat("the blobs belong to the catalog ", mark, ", and this one is ", id, kAdvice));
  }
  if (!options.is_forced && !options.may_mark) {
    // A new store with an upload under way has nothing to delete yet.
    if (!options.has_old) return absl::OkStatus();
    return absl::FailedPreconditionError(
        absl::StrCat("this catalog, ", id, ", refers to none of the blobs", kAdvice));
  }
  return options.dry_run ? absl::OkStatus() : blobs.WriteCatalogId(id);
}

}  // namespace liquidblend::admin
