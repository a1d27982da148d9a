// Queue of ended spans that wait to be exported, within bounds of memory and rate.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include "core/base/steady_cond_var.h"
#include "core/trace/span_record.h"

namespace liquidblend::trace {

struct SpanQueueOptions {
  size_t max_spans = 2048;  // >= 1; more are dropped
  // >= 0; of spans, on average; 0: no limit. A second's worth may come at once.
  double max_per_second = 1000;
};

// Counts since the start.
struct SpanStats {
  int64_t num_exported = 0;
  int64_t num_over_rate = 0;   // dropped: beyond the rate; spans without their children
  int64_t num_over_queue = 0;  // dropped: the queue was full
  int64_t num_refused = 0;     // dropped: the collector could not be reached, or did not take them
  int64_t num_dropped() const { return num_over_rate + num_over_queue + num_refused; }
};

// Threads: safe. No call but Take() and Pause() waits.
class SpanQueue {
 public:
  explicit SpanQueue(const SpanQueueOptions& options)
      : options_(options), tokens_(options.max_per_second) {}

  // Whether the rate admits one more span that has no parent in this program. Those below it are
  // admitted with it, so that traces stay whole; Charge() counts them.
  bool Admit();
  void Charge();

  // Adds a span that has ended.
  void Push(SpanRecord span);

  // Takes up to max_spans. Waits until there are so many, or the first has waited for `delay`, or
  // Close() has been called; then there may be none.
  std::vector<SpanRecord> Take(size_t max_spans, absl::Duration delay);

  // Waits for so long, but no longer than until Close().
  void Pause(absl::Duration duration);

  // From now on spans are dropped uncounted, and Take() does not wait.
  void Close();
  bool is_closed() const;
  bool empty() const;

  void CountExported(int64_t num_spans);
  void CountRefused(int64_t num_spans);
  SpanStats stats() const;

 private:
  void Refill() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const SpanQueueOptions options_;
  mutable absl::Mutex mutex_;
  base::SteadyCondVar changed_;
  std::deque<SpanRecord> spans_ ABSL_GUARDED_BY(mutex_);
  bool is_closed_ ABSL_GUARDED_BY(mutex_) = false;
  SpanStats stats_ ABSL_GUARDED_BY(mutex_);
  double tokens_ ABSL_GUARDED_BY(mutex_);  // spans that may come now
  base::SteadyClock::time_point refilled_ ABSL_GUARDED_BY(mutex_) = base::SteadyClock::now();
};

}  // namespace liquidblend::trace
