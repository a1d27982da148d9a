// Exporter of spans: a thread that sends those of a queue to a collector.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include "core/base/steady_cond_var.h"
#include "core/store/blobs/http_client.h"
#include "core/trace/options.h"
#include "core/trace/span_queue.h"

namespace liquidblend::trace {

// Takes a line for the log; called from the exporter's thread.
using Report = std::function<void(const std::string& line)>;

// Requests that fail for a while (no connection, status 429, 502, 503 or 504) are repeated
// kAttempts times in all; then, and if the collector refuses them, their spans are dropped and
// counted. Dropped spans are reported, once a minute at most.  Threads: one.
class Exporter {
 public:
  static constexpr int kAttempts = 3;

  // Starts the thread.  Requires: options.url is not empty.
  Exporter(TracerOptions options, std::shared_ptr<SpanQueue> queue, Report report);
  ~Exporter();  // Stop() without patience
  Exporter(const Exporter&) = delete;
  Exporter& operator=(const Exporter&) = delete;

  // Closes the queue, sends what waits in it, for as long as `patience`, and ends the thread.
  void Stop(absl::Duration patience);

 private:
  void Run();
  void Export(const std::vector<SpanRecord>& spans);
  absl::Status Send(const std::string& body, int64_t num_spans);
  void ReportDropped(const SpanStats& stats);

  const TracerOptions options_;
  const std::string shown_url_;
  const std::shared_ptr<SpanQueue> queue_;
  const Report report_;
  store::HttpClient http_;
  absl::Status last_error_;  // of the thread, like the next two
  int64_t num_reported_ = 0;
  base::SteadyClock::time_point reported_at_;
  std::atomic<bool> is_given_up_ = false;  // requests end at once
  absl::Mutex mutex_;
  base::SteadyCondVar ended_;
  bool has_ended_ ABSL_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace liquidblend::trace
