#include "server/catalog/family_uses.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/log.h"

namespace liquidblend::catalog {

void FamilyUses::Count(const std::string& id) {
  absl::MutexLock lock(&mutex_);
  ++counts_[id];
}

void FamilyUses::Record(store::Catalog& catalog) {
  Counts counts;
  {
    absl::MutexLock lock(&mutex_);
    counts.swap(counts_);
  }
  if (counts.empty()) return;
  const absl::Status recorded = catalog.RecordFamilyUses(counts);
  if (recorded.ok()) return;
  base::LogWarning(absl::StrCat("the use of families is not recorded yet: ", recorded.ToString()));
  absl::MutexLock lock(&mutex_);
  for (const auto& [id, num_frames] : counts) counts_[id] += num_frames;
}

}  // namespace liquidblend::catalog
