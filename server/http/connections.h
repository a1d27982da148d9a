// The open connections of a port: how many there are, and how they hear that the port stops. Knows
// no sockets.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

namespace liquidblend::http {

// Each goes further than the one before.
enum class Phase {
  kServing,
  kDraining,  // what lasts ends: streams
  kStopping,  // connections end as soon as no request is being answered
  kAborting,  // connections end at once
};

class Connection {
 public:
  virtual ~Connection() = default;
  // Called on any thread; must not block.
  virtual void OnPhase(Phase phase) = 0;
};

// Threads: safe.
class Connections : public std::enable_shared_from_this<Connections> {
 public:
  // One place among the connections, for as long as it lives.
  class Ticket {
   public:
    Ticket(Ticket&& other) = default;
    Ticket& operator=(Ticket&&) = delete;
    ~Ticket();
    // Whom to tell of phases from now on, instead of anyone before. A connection that comes late
    // is told at once.
    void Watch(const std::shared_ptr<Connection>& connection);

   private:
    friend class Connections;
    Ticket(std::shared_ptr<Connections> all, int64_t id) : all_(std::move(all)), id_(id) {}
    std::shared_ptr<Connections> all_;  // null: moved away
    int64_t id_;
  };

  // Nothing if there are `max_connections` already, or if the port stops.
  std::optional<Ticket> Enter(int max_connections);

  // Tells all connections. Goes only forward.
  void Advance(Phase phase);
  Phase phase() const;

  // Waits until all have ended. False: some have not when the time is over.
  bool AwaitNone(absl::Duration patience) const;

 private:
  mutable absl::Mutex mutex_;
  Phase phase_ ABSL_GUARDED_BY(mutex_) = Phase::kServing;
  int64_t next_id_ ABSL_GUARDED_BY(mutex_) = 0;
  std::map<int64_t, std::weak_ptr<Connection>> open_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace liquidblend::http
