#include "tests/bench/stored_family.h"

#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>

#include "core/base/status_macros.h"
#include "core/store/files/files.h"
#include "core/store/open_store.h"

namespace liquidblend::bench {
namespace {

const char* DataDirectory() { return std::getenv("LIQUIDBLEND_BENCH_DATA"); }
const char* Id() { return std::getenv("LIQUIDBLEND_BENCH_FAMILY"); }

absl::StatusOr<mesh::RegisteredFamily> Load(const std::string& data, const std::string& id) {
  store::StoreLocation location;
  location.data = data;
  LB_ASSIGN_OR_RETURN(const store::Store store, store::OpenStore(location));
  LB_ASSIGN_OR_RETURN(const auto record, store.catalog->GetFamily(id));
  LB_ASSIGN_OR_RETURN(std::shared_ptr<const store::Blob> blob, store.blobs->Open(record.blob()));
  return store::OpenFamily(std::move(blob), id);
}

}  // namespace

bool HasStoredFamily() { return DataDirectory() != nullptr && Id() != nullptr; }

const Loaded& StoredFamily() {
  static const Loaded& loaded = *[] {
    auto family = Load(DataDirectory(), Id());
    if (!family.ok()) {
      std::fprintf(stderr, "lb_bench: %s\n", family.status().ToString().c_str());
      std::abort();
    }
    return new Loaded(*std::move(family));
  }();
  return loaded;
}

}  // namespace liquidblend::bench
