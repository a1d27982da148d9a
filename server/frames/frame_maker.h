// Who asks for a frame gets it from here: from the cache, from one that is being made already, or
// from a turn on the pool.
#pragma once

#include <atomic>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/functional/any_invocable.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "server/base/work_pool.h"
#include "server/frames/frame_buffer_pool.h"
#include "server/frames/frame_cache.h"
#include "server/frames/frame_pool.h"
#include "server/metrics/metrics.h"

namespace liquidblend::server {

struct FrameOrder {
  catalog::FamilyPtr loaded;
  FrameQuery query;
  std::string client;        // who is charged
  bool is_paced = false;     // it has to be on time
  absl::Duration deadline;   // when it becomes late, as SteadyNow()
  bool is_refusable = true;  // false: goes on with what was accepted before
};

// Threads: safe.
class FrameMaker {
 public:
  using Done = absl::AnyInvocable<void(absl::StatusOr<FramePtr>)>;
  class Waiter;
  using Ticket = std::shared_ptr<Waiter>;

  // All outlive this; the pool is stopped before this is destroyed.
  FrameMaker(FrameCache& cache, FramePool& pool, FrameBufferPool& buffer_pool,
             metrics::Metrics& metrics)
      : cache_(cache), pool_(pool), buffer_pool_(buffer_pool), metrics_(metrics) {}

  // Calls `done` once, before this returns (a cached frame, a refusal) or on a thread of the pool.
  // All that ask for one frame while it is made wait for the same one; whose turn comes first
  // makes it for all.
  // Requires: CheckQuery().ok() for the order's query.  Errors: MakeFrame's, FramePool::Post's.
  // Returns what Leave() takes; nothing if `done` has been called.
  Ticket Make(FrameOrder order, Done done);

  // Waits no longer; `done` may be running, but is not called later. A frame that nobody waits for
  // is not made, or no further.
  void Leave(const Ticket& ticket);

 private:
  struct Flight;  // one frame on its way
  using FlightPtr = std::shared_ptr<Flight>;

  absl::Status Join(FrameOrder order, const FrameKey& key, const Ticket& ticket)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Run(const FlightPtr& flight);
  absl::StatusOr<FramePtr> MakeMessage(const Flight& flight);
  void Remove(const Ticket& ticket) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void EraseFlight(const FlightPtr& flight) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  FrameCache& cache_;
  FramePool& pool_;
  FrameBufferPool& buffer_pool_;
  metrics::Metrics& metrics_;
  absl::Mutex mutex_;
  std::map<std::string, FlightPtr> flights_ ABSL_GUARDED_BY(mutex_);  // by the key's bytes
};

}  // namespace liquidblend::server
