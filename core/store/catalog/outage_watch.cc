#include "core/store/catalog/outage_watch.h"

#include <algorithm>

#include "core/base/retry.h"

namespace liquidblend::store {
namespace {

// A database that comes back may answer some calls before it answers all.
constexpr absl::Duration kLongestGap = absl::Seconds(5);

}  // namespace

void OutageWatch::Note(base::SteadyClock::time_point begin, const absl::Status& status) {
  if (!base::IsTransient(status)) return;
  const absl::MutexLock lock(&mutex_);
  const bool is_same = has_outage_ && absl::FromChrono(begin - end_) <= kLongestGap;
  begin_ = is_same ? std::min(begin_, begin) : begin;
  end_ = base::SteadyClock::now();
  has_outage_ = true;
}

Outage OutageWatch::Last(absl::Time now) const {
  const absl::MutexLock lock(&mutex_);
  if (!has_outage_) return Outage();
  return {.begin = now - base::Since(begin_), .end = now - base::Since(end_)};
}

}  // namespace liquidblend::store
