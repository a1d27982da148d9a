#include "server/access/upload_tally.h"

namespace liquidblend::server {
namespace {

void End(const std::string& id, std::map<std::string, int64_t>& promised, int64_t& bytes) {
  const auto found = promised.find(id);
  if (found == promised.end()) return;
  bytes -= found->second;
  promised.erase(found);
}

}  // namespace

int64_t UploadTally::Add(const std::string& owner, int64_t bytes) {
  const absl::MutexLock lock(&mutex_);
  Count* count = Find(owner);
  if (count == nullptr && bytes <= 0) return 0;
  if (count == nullptr) count = &counts_[owner];
  count->bytes += bytes;
  const int64_t sum = count->bytes;
  if (sum == 0 && count->ends.empty()) counts_.erase(owner);
  return sum;
}

int64_t UploadTally::Sum() {
  const absl::MutexLock lock(&mutex_);
  int64_t sum = 0;
  for (const auto& [owner, count] : counts_) sum += Find(owner)->bytes;
  return sum;
}

int64_t UploadTally::AddUnwritten(int64_t bytes) {
  const absl::MutexLock lock(&mutex_);
  return unwritten_bytes_ += bytes;
}

bool UploadTally::Promise(const std::string& owner, const std::string& id, int64_t bytes,
                          absl::Duration duration) {
  const absl::MutexLock lock(&mutex_);
  Count* count = Find(owner);
  if (count == nullptr) count = &counts_[owner];
  if (count->ends.size() >= kMaxPromises) return false;
  const auto end = base::SteadyClock::now() + absl::ToChronoNanoseconds(duration);
  count->ends.emplace_back(end, id);
  count->promised[id] = bytes;
  count->bytes += bytes;
  return true;
}

bool UploadTally::HasPromise(const std::string& owner, const std::string& id) {
  const absl::MutexLock lock(&mutex_);
  const Count* const count = Find(owner);
  return count != nullptr && count->promised.contains(id);
}

void UploadTally::EndPromise(const std::string& owner, const std::string& id) {
  const absl::MutexLock lock(&mutex_);
  Count* const count = Find(owner);
  if (count != nullptr) End(id, count->promised, count->bytes);
}

UploadTally::Count* UploadTally::Find(const std::string& owner) {
  const auto found = counts_.find(owner);
  if (found == counts_.end()) return nullptr;
  Count& count = found->second;
  const base::SteadyClock::time_point now = base::SteadyClock::now();
  while (!count.ends.empty() && count.ends.front().first <= now) {
    End(count.ends.front().second, count.promised, count.bytes);
    count.ends.pop_front();
  }
  return &count;
}

}  // namespace liquidblend::server
