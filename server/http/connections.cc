#include "server/http/connections.h"

#include <vector>

namespace liquidblend::http {

Connections::Ticket::~Ticket() {
  if (all_ == nullptr) return;
  absl::MutexLock lock(&all_->mutex_);
  all_->open_.erase(id_);
}

void Connections::Ticket::Watch(const std::shared_ptr<Connection>& connection) {
  Phase phase = Phase::kServing;
  {
    absl::MutexLock lock(&all_->mutex_);
    all_->open_[id_] = connection;
    phase = all_->phase_;
  }
  if (phase != Phase::kServing) connection->OnPhase(phase);
}

std::optional<Connections::Ticket> Connections::Enter(int max_connections) {
  absl::MutexLock lock(&mutex_);
  if (phase_ >= Phase::kStopping || open_.size() >= static_cast<size_t>(max_connections)) {
    return std::nullopt;
  }
  open_[next_id_] = {};
  return Ticket(shared_from_this(), next_id_++);
}

void Connections::Advance(Phase phase) {
  std::vector<std::shared_ptr<Connection>> told;
  {
    absl::MutexLock lock(&mutex_);
    if (phase <= phase_) return;
    phase_ = phase;
    for (const auto& [id, connection] : open_) {
      if (std::shared_ptr<Connection> alive = connection.lock()) told.push_back(std::move(alive));
    }
  }
  for (const std::shared_ptr<Connection>& connection : told) connection->OnPhase(phase);
}

Phase Connections::phase() const {
  absl::MutexLock lock(&mutex_);
  return phase_;
}

bool Connections::AwaitNone(absl::Duration patience) const {
  absl::MutexLock lock(&mutex_);
  const auto is_empty = [this] {
    mutex_.AssertHeld();
    return open_.empty();
  };
  return mutex_.AwaitWithTimeout(absl::Condition(&is_empty), patience);
}

}  // namespace liquidblend::http
