// Cache of encoded frames.
#pragma once

#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <unordered_map>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"
#include "server/catalog/families.h"
#include "server/frames/make_frame.h"

namespace liquidblend::server {

// The bytes of a serialised v1::Frame, shared by all calls that answer with it, never copied.
using FramePtr = std::shared_ptr<const std::string>;

// Key of a frame: all of its input. Equal keys give equal bytes.
struct FrameKey {
  std::string family;      // id
  std::string generation;  // LoadedFamily's
  std::string query;       // with defaults filled in
  std::string bytes() const { return generation + '\n' + query; }
  bool operator==(const FrameKey&) const = default;
};

// The key of a query's frame.  Requires: CheckQuery().ok().
FrameKey KeyOf(const catalog::LoadedFamily& loaded, const FrameQuery& query);

// Cache of encoded frames within a budget of bytes; the least recently used go first. Threads:
// safe.
class FrameCache {
 public:
  struct Stats {
    int64_t num_hits = 0;
    int64_t num_misses = 0;
    int64_t num_frames = 0;  // kept now
    int64_t size_bytes = 0;
  };

  // Makes an empty cache.  Requires: budget_bytes >= 0; 0 keeps nothing.
  explicit FrameCache(int64_t budget_bytes) : budget_bytes_(budget_bytes) {}

  FramePtr Find(const FrameKey& key);  // or nothing

  // Keeps the frame, unless it is larger than the budget or of a version that has been replaced.
  void Insert(const FrameKey& key, FramePtr frame);

  // Announces the served version of a family, unless a later one has been announced. Frames of
  // other versions are removed.  Cost: O(frames) if it is another one than before.
  void Announce(const catalog::LoadedFamily& loaded);

  // Counts since the start, and what is kept now.
  Stats stats() const;

 private:
  struct Entry {
    std::string key;
    std::string family;
    FramePtr frame;
  };
  using Entries = std::list<Entry>;
  struct Announced {
    int64_t version = 0;
    std::string generation;
  };

  void Erase(Entries::iterator entry) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const int64_t budget_bytes_;
  mutable absl::Mutex mutex_;
  Entries entries_ ABSL_GUARDED_BY(mutex_);  // the most recently used first
  std::unordered_map<std::string_view, Entries::iterator> by_key_ ABSL_GUARDED_BY(mutex_);
  std::map<std::string, Announced> announced_ ABSL_GUARDED_BY(mutex_);  // by family
  Stats stats_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace liquidblend::server
