// Progress line of a long command, on a terminal.
#pragma once

#include <cstdint>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

namespace liquidblend::admin {

// One line of standard error, drawn again at most ten times a second. Threads: safe.
class Progress {
 public:
  enum class Style { kNone, kTerminal };
  // kTerminal if standard error is one.
  static Style ChooseStyle();

  explicit Progress(Style style) : style_(style) {}
  ~Progress() { End(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  // total_bytes < 0: not known.
  void Begin(std::string action, int64_t total_bytes) ABSL_LOCKS_EXCLUDED(mutex_);
  void Add(int64_t num_bytes) ABSL_LOCKS_EXCLUDED(mutex_);  // of one more blob
  void End() ABSL_LOCKS_EXCLUDED(mutex_);

 private:
  void Draw() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const Style style_;
  absl::Mutex mutex_;
  std::string action_ ABSL_GUARDED_BY(mutex_);
  int64_t total_bytes_ ABSL_GUARDED_BY(mutex_) = 0;
  int64_t num_bytes_ ABSL_GUARDED_BY(mutex_) = 0;
  int64_t num_blobs_ ABSL_GUARDED_BY(mutex_) = 0;
  bool is_drawn_ ABSL_GUARDED_BY(mutex_) = false;
  absl::Time last_ ABSL_GUARDED_BY(mutex_) = absl::InfinitePast();
};

// "12.3 MB"
std::string FormatBytes(int64_t bytes);

}  // namespace liquidblend::admin
