// Counts of the frames that families are asked for, on their way to the catalog.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"
#include "core/store/catalog/catalog.h"

namespace liquidblend::catalog {

// Threads: safe.
class FamilyUses {
 public:
  // One more frame of the family is asked for.  Cost: a look-up by name.
  void Count(const std::string& id);

  // Adds the counts to those of the catalog, and begins anew. If the catalog does not take them,
  // which is logged, they are kept for the next time. Waits for the catalog, unless nothing was
  // counted.
  void Record(store::Catalog& catalog);

 private:
  using Counts = std::map<std::string, int64_t>;

  absl::Mutex mutex_;
  Counts counts_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace liquidblend::catalog
