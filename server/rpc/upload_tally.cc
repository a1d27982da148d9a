#include "server/rpc/upload_tally.h"

#include <utility>

namespace liquidblend::rpc {

int64_t UploadTally::Add(const std::string& owner, int64_t bytes) {
  const absl::MutexLock lock(&mutex_);
  return AddTo(owner, bytes);
}

int64_t UploadTally::Promise(const std::string& owner, const std::string& id, int64_t bytes,
                             absl::Duration duration) {
  const absl::MutexLock lock(&mutex_);
  const auto end = base::SteadyClock::now() + absl::ToChronoNanoseconds(duration);
  counts_[owner].promised[id] = {end, bytes};
  return AddTo(owner, bytes);
}

void UploadTally::EndPromise(const std::string& owner, const std::string& id) {
  const absl::MutexLock lock(&mutex_);
  const auto count = counts_.find(owner);
  if (count == counts_.end()) return;
  const auto promised = count->second.promised.find(id);
  if (promised != count->second.promised.end()) promised->second.end = {};
  AddTo(owner, 0);
}

// Takes off what is promised no longer.
int64_t UploadTally::AddTo(const std::string& owner, int64_t bytes) {
  Count& count = counts_[owner];
  count.bytes += bytes;
  const base::SteadyClock::time_point now = base::SteadyClock::now();
  std::erase_if(count.promised, [&](const auto& entry) {
    if (entry.second.end > now) return false;
    count.bytes -= entry.second.bytes;
    return true;
  });
  const int64_t sum = count.bytes;
  if (sum == 0 && count.promised.empty()) counts_.erase(owner);
  return sum;
}

}  // namespace liquidblend::rpc
