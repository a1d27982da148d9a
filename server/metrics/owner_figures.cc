#include "server/metrics/owner_figures.h"

#include <algorithm>
#include <tuple>
#include <utility>

namespace liquidblend::metrics {
namespace {

bool IsLimited(const OwnerFigures& owner) {
  return owner.limits.max_stored_bytes > 0 || owner.limits.max_queued_jobs > 0;
}

bool ComesFirst(const OwnerFigures& a, const OwnerFigures& b) {
  return std::make_tuple(!IsLimited(a), -a.stored_bytes, -a.queued_jobs, a.owner) <
         std::make_tuple(!IsLimited(b), -b.stored_bytes, -b.queued_jobs, b.owner);
}

}  // namespace

std::vector<OwnerFigures> JoinOwners(const std::vector<store::OwnerUse>& uses,
                                     const std::map<std::string, OwnerLimits>& limits) {
  std::map<std::string, OwnerFigures> by_name;
  for (const auto& [name, limit] : limits) by_name[name].limits = limit;
  for (const store::OwnerUse& use : uses) {
    OwnerFigures& owner = by_name[use.owner];
    owner.stored_bytes = use.stored_bytes;
    owner.queued_jobs = use.num_queued_jobs;
  }
  std::vector<OwnerFigures> owners;
  for (auto& [name, owner] : by_name) {
    owner.owner = name.empty() ? "(nobody)" : name;
    owners.push_back(std::move(owner));
  }
  std::sort(owners.begin(), owners.end(), ComesFirst);
  if (owners.size() <= kMaxOwners) return owners;
  OwnerFigures others = {.owner = "(others)", .limits = {}};
  for (size_t k = kMaxOwners; k < owners.size(); ++k) {
    others.stored_bytes += owners[k].stored_bytes;
    others.queued_jobs += owners[k].queued_jobs;
  }
  owners.resize(kMaxOwners);
  owners.push_back(std::move(others));
  return owners;
}

}  // namespace liquidblend::metrics
