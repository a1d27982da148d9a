#include "server/store_flags.h"

#include <CLI/CLI.hpp>

namespace liquidblend::server {

void AddStoreFlags(CLI::App& app, store::StoreLocation& location) {
  app.add_option("--data", location.data, "Directory of everything that is kept, on one machine");
  app.add_option("--store", location.catalog_url,
                 "Instead of --data: postgresql://..., shared by many machines")
      ->envname("LIQUIDBLEND_STORE");
  app.add_option("--blobs", location.blobs_url, "With --store: s3://bucket/prefix")
      ->envname("LIQUIDBLEND_BLOBS");
  app.add_option("--cache", location.cache, "With --store: directory for blobs that are in use")
      ->envname("LIQUIDBLEND_CACHE");
  app.add_option("--cache-size", location.cache_bytes, "Disk space for --cache, e.g. 64GiB")
      ->transform(CLI::AsSizeValue(false));
}

}  // namespace liquidblend::server
