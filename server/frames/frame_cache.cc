#include "server/frames/frame_cache.h"

#include <cstring>
#include <utility>

#include "server/frames/encoding.h"

namespace liquidblend::server {
namespace {

constexpr int64_t kEntryBytes = 256;  // of the containers, about

template <typename Number>
void Append(Number number, std::string& bytes) {
  char raw[sizeof(Number)];
  std::memcpy(raw, &number, sizeof(Number));
  bytes.append(raw, sizeof(Number));
}

// Appends the encoding with defaults filled in, so that equal options have equal bytes.
void AppendEncoding(const catalog::LoadedFamily& loaded, const v1::Encoding& encoding,
                    std::string& bytes) {
  const encode::DracoOptions options = DracoOptionsOf(loaded.grid, encoding);
  const bool is_draco = encoding.format() == v1::Encoding::FORMAT_UNSPECIFIED;
  Append<int32_t>(is_draco ? v1::Encoding::DRACO : encoding.format(), bytes);
  Append(options.preset, bytes);
  Append<int32_t>(options.position_bits, bytes);
}

int64_t BytesOf(const std::string& key, const std::string& frame) {
  return static_cast<int64_t>(key.size() + frame.size()) + kEntryBytes;
}

}  // namespace

FrameKey KeyOf(const catalog::LoadedFamily& loaded, const FrameQuery& query) {
  FrameKey key = {loaded.family.name, loaded.generation, {}};
  std::string& bytes = key.query;
  for (const double weight : query.weights) Append(weight, bytes);
  Append(query.time_s, bytes);
  Append<int32_t>((query.is_extrapolated ? 1 : 0) + (query.is_clamped ? 2 : 0), bytes);
  AppendEncoding(loaded, query.encoding, bytes);
  query.surface.AppendToString(&bytes);
  return key;
}

FramePtr FrameCache::Find(const FrameKey& key) {
  const std::string bytes = key.bytes();
  absl::MutexLock lock(&mutex_);
  const auto found = by_key_.find(bytes);
  if (found == by_key_.end()) {
    ++stats_.num_misses;
    return nullptr;
  }
  ++stats_.num_hits;
  entries_.splice(entries_.begin(), entries_, found->second);
  return found->second->frame;
}

void FrameCache::Insert(const FrameKey& key, FramePtr frame) {
  std::string bytes = key.bytes();
  const int64_t size = BytesOf(bytes, *frame);
  absl::MutexLock lock(&mutex_);
  const auto announced = announced_.find(key.family);
  const bool is_replaced =
      announced != announced_.end() && announced->second.generation != key.generation;
  if (size > budget_bytes_ || is_replaced || by_key_.contains(bytes)) return;
  entries_.push_front({std::move(bytes), key.family, std::move(frame)});
  by_key_[entries_.front().key] = entries_.begin();
  stats_.size_bytes += size;
  ++stats_.num_frames;
  while (stats_.size_bytes > budget_bytes_) Erase(std::prev(entries_.end()));
}

void FrameCache::Announce(const catalog::LoadedFamily& loaded) {
  absl::MutexLock lock(&mutex_);
  Announced& announced = announced_[loaded.family.name];
  const bool is_known = announced.generation == loaded.generation;
  if (is_known || loaded.family.version < announced.version) return;
  announced = {loaded.family.version, loaded.generation};
  for (auto it = entries_.begin(); it != entries_.end();) {
    const auto entry = it++;
    if (entry->family == loaded.family.name) Erase(entry);
  }
}

void FrameCache::Erase(Entries::iterator entry) {
  stats_.size_bytes -= BytesOf(entry->key, *entry->frame);
  --stats_.num_frames;
  by_key_.erase(entry->key);
  entries_.erase(entry);
}

FrameCache::Stats FrameCache::stats() const {
  absl::MutexLock lock(&mutex_);
  return stats_;
}

}  // namespace liquidblend::server
