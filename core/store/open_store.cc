#include "core/store/open_store.h"

#include <cstdlib>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/store/blobs/s3_blob_store.h"
#include "core/store/data_directory.h"
#include "core/store/sql/postgres_url.h"

namespace liquidblend::store {
namespace {

// The id of no content that anyone knows.
constexpr char kNoBlob[] =
    "sha256-0000000000000000000000000000000000000000000000000000000000000000";

}  // namespace

absl::Status StoreLocation::Validate() const {
  if (data.empty() == catalog_url.empty()) {
    return absl::InvalidArgumentError(
        "either --data DIR, or --store postgresql://..., --blobs s3://... and --cache DIR");
  }
  for (const auto& [flag, value] :
       {std::pair("--blobs", &blobs_url), std::pair("--cache", &cache)}) {
    if (value->empty() != catalog_url.empty()) {
      return absl::InvalidArgumentError(
          absl::StrCat(flag, " goes with --store, and --store with ", flag));
    }
  }
  if (!client_endpoint.empty() && catalog_url.empty()) {
    return absl::InvalidArgumentError("--client-s3 goes with --store");
  }
  if (cache_bytes >= 0) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("--cache-size is out of range: ", cache_bytes));
}

void TakeFromEnvironment(StoreLocation& location) {
  std::string& place = location.is_shared() ? location.cache : location.data;
  if (!place.empty()) return;
  const char* value = getenv(location.is_shared() ? "LIQUIDBLEND_CACHE" : "LIQUIDBLEND_DATA");
  if (value != nullptr) place = value;
}

absl::StatusOr<std::string> NameOfStore(const StoreLocation& location) {
  if (!location.is_shared()) return location.data;
  LB_ASSIGN_OR_RETURN(const PostgresTarget target,
                      ParsePostgresUrl(location.catalog_url, CatalogOptions().busy_timeout));
  return absl::StrCat(target.name, " and ", location.blobs_url);
}

absl::StatusOr<std::unique_ptr<Catalog>> OpenCatalog(const StoreLocation& location) {
  LB_RETURN_IF_ERROR(location.Validate());
  if (location.is_shared()) return OpenPostgresCatalog(location.catalog_url);
  return OpenSqliteCatalog(CatalogPath(location.data));
}

absl::StatusOr<std::unique_ptr<BlobStore>> OpenBlobs(const StoreLocation& location) {
  LB_RETURN_IF_ERROR(location.Validate());
  if (!location.is_shared()) return OpenLocalBlobStore(location.data);
  S3Options options;
  options.cache_directory = location.cache;
  options.cache_bytes = location.cache_bytes;
  options.client_endpoint = location.client_endpoint;
  return OpenS3BlobStore(location.blobs_url, options);
}

absl::StatusOr<Store> OpenStore(const StoreLocation& location) {
  LB_RETURN_IF_ERROR(location.Validate());
  Store store;
  LB_ASSIGN_OR_RETURN(store.name, NameOfStore(location));
  LB_ASSIGN_OR_RETURN(store.catalog, OpenCatalog(location));
  LB_ASSIGN_OR_RETURN(store.blobs, OpenBlobs(location));
  return store;
}

absl::Status CheckCatalog(Catalog& catalog) { return catalog.ListFamilies(1, "").status(); }

absl::Status CheckBlobs(BlobStore& blobs) {
  const absl::Status opened = blobs.Open(kNoBlob).status();
  return absl::IsNotFound(opened) ? absl::OkStatus() : opened;
}

absl::Status CheckReachable(Catalog& catalog, BlobStore& blobs) {
  LB_RETURN_IF_ERROR(CheckCatalog(catalog));
  return CheckBlobs(blobs);
}

std::string DescribeTables() {
  return absl::StrCat("tables ", SqliteTablesVersion(), " of SQLite, ", PostgresTablesVersion(),
                      " of PostgreSQL");
}

}  // namespace liquidblend::store
