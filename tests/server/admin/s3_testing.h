// A store whose blobs are in a fake S3, and whose catalog is in SQLite.
#pragma once

#include <string>

#include "core/store/blobs/s3_blob_store.h"
#include "core/store/open_store.h"
#include "tests/core/store/blobs/fake_s3.h"
#include "tests/core/store/store_testing.h"

namespace liquidblend::admin {

inline store::Store OpenFakeS3Store(const store::FakeS3& s3, const std::string& folder) {
  store::S3Options options;
  options.endpoint = s3.endpoint();
  options.access_key_id = "key";
  options.secret_access_key = "secret";
  options.first_pause = absl::Milliseconds(1);
  options.longest_pause = absl::Milliseconds(4);
  options.cache_directory = folder + "/cache";
  store::Store store;
  store.catalog = *store::OpenSqliteCatalog(folder + "/catalog.db");
  store.blobs = *store::OpenS3BlobStore("s3://bucket/store", options);
  return store;
}

}  // namespace liquidblend::admin
