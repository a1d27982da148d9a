// The open connections of a port: their number, and their notification when the port stops. Knows
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

// Phases of a port's stop, in their order.
enum class Phase {
  kServing,
  kDraining,  // streams end
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
    // Sets the connection to notify of phases, instead of the one before. A late connection is
    // notified at once.
    void Watch(const std::shared_ptr<Connection>& connection);

   private:
    friend class Connections;
    Ticket(std::shared_ptr<Connections> all, int64_t id) : all_(std::move(all)), id_(id) {}
    std::shared_ptr<Connections> all_;  // null: moved away
    int64_t id_;
  };

  // Nothing if there are `max_connections` already, or if the port stops.
  std::optional<Ticket> Enter(int max_connections);

  // Enters a phase and notifies all connections. Phases only advance.
  void Advance(Phase phase);
  Phase phase() const;

  // Waits until all connections have ended. False after `patience`.
  bool AwaitNone(absl::Duration patience) const;

 private:
  mutable absl::Mutex mutex_;
  Phase phase_ ABSL_GUARDED_BY(mutex_) = Phase::kServing;
  int64_t next_id_ ABSL_GUARDED_BY(mutex_) = 0;
  std::map<int64_t, std::weak_ptr<Connection>> open_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace liquidblend::http
