// Layout of a data directory: the embedded store of one machine, which one server and any number of
// workers share. Blobs are in it, too (OpenLocalBlobStore).
#pragma once

#include <string>

namespace liquidblend::store {

// The path for OpenSqliteCatalog().
inline std::string CatalogPath(const std::string& data_directory) {
  return data_directory + "/catalog.sqlite";
}

}  // namespace liquidblend::store
