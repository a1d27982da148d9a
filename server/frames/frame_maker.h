// Source of frames for all calls: the cache, a frame that is being made already, or a turn on the
// pool.
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
#include "core/trace/span.h"
#include "server/base/work_pool.h"
#include "server/catalog/family_uses.h"
#include "server/frames/frame_cache.h"
#include "server/frames/frame_pool.h"
#include "server/metrics/metrics.h"

namespace liquidblend::server {

// Order of a frame: what to make, for whom and by when.
struct FrameOrder {
  catalog::FamilyPtr loaded;
  FrameQuery query;
  std::string client;        // the account that is charged
  bool is_paced = false;     // it has to be on time
  absl::Duration deadline;   // when it becomes late, as SteadyNow()
  bool is_refusable = true;  // false: continues accepted work
  trace::Span span = {};     // of the call; gets the stages of the frame
};

// Threads: safe.
// Maker of frames for all calls.
class FrameMaker {
 public:
  using Done = absl::AnyInvocable<void(absl::StatusOr<FramePtr>)>;
  class Waiter;
  using Ticket = std::shared_ptr<Waiter>;

  // All outlive this; the pool is stopped before this is destroyed.
  FrameMaker(FrameCache& cache, FramePool& pool, FrameBufferPool& buffer_pool,
             catalog::FamilyUses& uses, metrics::Metrics& metrics)
      : cache_(cache), pool_(pool), buffer_pool_(buffer_pool), uses_(uses), metrics_(metrics) {}

  // Calls `done` once, before this returns (a cached frame, a refusal) or on a thread of the pool.
  // Calls for one frame share its making; the first one whose turn comes makes it for all.
  // Requires: CheckQuery().ok() for the order's query.  Errors: MakeFrame's, FramePool::Post's.
  // Returns a ticket for Leave(); null if `done` has been called.
  Ticket Make(FrameOrder order, Done done);

  // Gives up waiting; `done` may be running, but is not called later. A frame without waiting calls
  // is not made, or its making stops.
  void Leave(const Ticket& ticket);

 private:
  struct Flight;  // a frame that is being made
  using FlightPtr = std::shared_ptr<Flight>;

  absl::Status Join(FrameOrder order, const FrameKey& key, const Ticket& ticket)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Run(const FlightPtr& flight);
  absl::StatusOr<FramePtr> MakeMessage(Flight& flight);
  static void RecordStages(const Flight& flight, const Waiter& waiter);
  void Remove(const Ticket& ticket) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void EraseFlight(const FlightPtr& flight) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  FrameCache& cache_;
  FramePool& pool_;
  FrameBufferPool& buffer_pool_;
  catalog::FamilyUses& uses_;
  metrics::Metrics& metrics_;
  absl::Mutex mutex_;
  std::map<std::string, FlightPtr> flights_ ABSL_GUARDED_BY(mutex_);  // by the key's bytes
};

}  // namespace liquidblend::server
