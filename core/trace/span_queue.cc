#include "core/trace/span_queue.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace liquidblend::trace {

void SpanQueue::Refill() {
  const base::SteadyClock::time_point now = base::SteadyClock::now();
  const double seconds = absl::ToDoubleSeconds(absl::FromChrono(now - refilled_));
  refilled_ = now;
  tokens_ = std::min(tokens_ + seconds * options_.max_per_second, options_.max_per_second);
}

bool SpanQueue::Admit() {
  if (options_.max_per_second == 0) return true;
  absl::MutexLock lock(&mutex_);
  Refill();
  if (tokens_ <= 0) {
    ++stats_.num_over_rate;
    return false;
  }
  tokens_ -= 1;
  return true;
}

void SpanQueue::Charge() {
  absl::MutexLock lock(&mutex_);
  tokens_ -= 1;
}

void SpanQueue::Push(SpanRecord span) {
  absl::MutexLock lock(&mutex_);
  if (is_closed_) return;
  if (spans_.size() >= options_.max_spans) {
    ++stats_.num_over_queue;
    return;
  }
  spans_.push_back(std::move(span));
  changed_.SignalAll();
}

std::vector<SpanRecord> SpanQueue::Take(size_t max_spans, absl::Duration delay) {
  absl::MutexLock lock(&mutex_);
  const auto has_any = [this] {
    mutex_.AssertHeld();
    return is_closed_ || !spans_.empty();
  };
  const auto has_enough = [this, most = std::min(max_spans, options_.max_spans)] {
    mutex_.AssertHeld();
    return is_closed_ || spans_.size() >= most;
  };
  changed_.Await(&mutex_, has_any, absl::InfiniteDuration());
  changed_.Await(&mutex_, has_enough, delay);
  const auto end = spans_.begin() + static_cast<std::ptrdiff_t>(std::min(max_spans, spans_.size()));
  std::vector<SpanRecord> taken(std::make_move_iterator(spans_.begin()),
                                std::make_move_iterator(end));
  spans_.erase(spans_.begin(), end);
  return taken;
}

void SpanQueue::Pause(absl::Duration duration) {
  absl::MutexLock lock(&mutex_);
  const auto is_closed = [this] {
    mutex_.AssertHeld();
    return is_closed_;
  };
  changed_.Await(&mutex_, is_closed, duration);
}

void SpanQueue::Close() {
  absl::MutexLock lock(&mutex_);
  is_closed_ = true;
  changed_.SignalAll();
}

bool SpanQueue::is_closed() const {
  absl::MutexLock lock(&mutex_);
  return is_closed_;
}

bool SpanQueue::empty() const {
  absl::MutexLock lock(&mutex_);
  return spans_.empty();
}

void SpanQueue::CountExported(int64_t num_spans) {
  absl::MutexLock lock(&mutex_);
  stats_.num_exported += num_spans;
}

void SpanQueue::CountRefused(int64_t num_spans) {
  absl::MutexLock lock(&mutex_);
  stats_.num_refused += num_spans;
}

SpanStats SpanQueue::stats() const {
  absl::MutexLock lock(&mutex_);
  return stats_;
}

}  // namespace liquidblend::trace
