// Figures of owners: what each has in the store and in the queue, and what it may have.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/store/catalog/catalog.h"

namespace liquidblend::metrics {

// 0: not limited.
struct OwnerLimits {
  int64_t max_stored_bytes = 0;
  int64_t max_queued_jobs = 0;
};

struct OwnerFigures {
  std::string owner;  // "(nobody)" for data without one
  int64_t stored_bytes = 0;
  int64_t queued_jobs = 0;
  OwnerLimits limits;
};

// Beyond so many owners, the others have one entry together: Prometheus keeps each name.
inline constexpr size_t kMaxOwners = 64;

// Joins what owners have and may have, by their names. Owners with limits come first, then those
// who have most; those beyond kMaxOwners are added up as "(others)", without limits.
std::vector<OwnerFigures> JoinOwners(const std::vector<store::OwnerUse>& uses,
                                     const std::map<std::string, OwnerLimits>& limits);

}  // namespace liquidblend::metrics
