// Opening of a store, catalog and blobs, at the location that flags and environment give.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/store/blobs/blob_store.h"
#include "core/store/catalog/catalog.h"

namespace liquidblend::store {

// Either a data directory of one machine, or the places that many machines share.
struct StoreLocation {
  std::string data;                         // directory; SQLite and local files
  std::string catalog_url;                  // postgresql://...; may hold a password
  std::string blobs_url;                    // s3://bucket/prefix
  std::string cache;                        // directory for blobs of S3
  std::string client_endpoint;              // S3Options::client_endpoint
  int64_t cache_bytes = int64_t{64} << 30;  // >= 0

  bool is_shared() const { return !catalog_url.empty(); }
  // Errors: kInvalidArgument that names the flag (--data, --store, --blobs, --cache) which is
  // missing or too many.
  absl::Status Validate() const;
};

// Fills missing values from the environment: LIQUIDBLEND_DATA is --data unless there is --store,
// and LIQUIDBLEND_CACHE is --cache if there is. So a service may set both variables for either kind
// of store.
void TakeFromEnvironment(StoreLocation& location);

struct Store {
  std::unique_ptr<Catalog> catalog;
  std::unique_ptr<BlobStore> blobs;
  std::string name;  // for the log; without secrets
};

// Errors: Validate()'s, and those of the catalogs and blob stores.
absl::StatusOr<Store> OpenStore(const StoreLocation& location);

// Open one of the two.
absl::StatusOr<std::unique_ptr<Catalog>> OpenCatalog(const StoreLocation& location);
absl::StatusOr<std::unique_ptr<BlobStore>> OpenBlobs(const StoreLocation& location);
// Without secrets.
absl::StatusOr<std::string> NameOfStore(const StoreLocation& location);

// The versions that this program writes: "tables 7 of SQLite, 6 of PostgreSQL".
std::string DescribeTables();

// Check that the store, or both, answer; for probes.  Errors: those of the stores.
absl::Status CheckCatalog(Catalog& catalog);
absl::Status CheckBlobs(BlobStore& blobs);
absl::Status CheckReachable(Catalog& catalog, BlobStore& blobs);

}  // namespace liquidblend::store
