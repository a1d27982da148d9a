// Log lines of calls, for gRPC and HTTP alike. A client whose calls fail again and again cannot
// flood the log.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include "core/base/log.h"
#include "server/access/principal.h"

namespace liquidblend::server {

// A call that has ended.
struct EndedCall {
  base::LogFields how;  // method and outcome, e.g. method and code
  base::LogLevel level = base::LogLevel::kInfo;
  absl::Duration took;
  Caller caller;
  std::string resource;  // animations/{id} and the like, or empty
  std::string error;     // empty: success
};

// Writes one line per call. Of the failed calls of one client (a principal, or a host) within a
// second, the first kMaxLines get a line each; one more line counts the others.  Threads: safe.
class CallLog {
 public:
  static constexpr int kMaxLines = 10;
  static constexpr absl::Duration kWindow = absl::Seconds(1);

  using Later = std::function<void(absl::Duration delay, std::function<void()> work)>;

  // `later` runs work after a delay, or drops it; it runs none after this is destroyed.
  explicit CallLog(Later later) : later_(std::move(later)) {}
  ~CallLog() { Flush(); }

  void Tell(const EndedCall& call);

  // Writes the lines of all counted calls now.
  void Flush();

 private:
  // A second in which calls of a client failed.
  struct Window {
    int64_t num_calls = 0;
    base::LogFields last;  // of the counted calls
    base::LogLevel worst = base::LogLevel::kDebug;
  };

  bool MayTell(const EndedCall& call);
  void Close(const std::string& client);

  const Later later_;
  absl::Mutex mutex_;
  std::map<std::string, Window> windows_ ABSL_GUARDED_BY(mutex_);  // by client
};

// Log level of a call's outcome: kError for codes that should not happen, `if_ok` for success,
// otherwise kInfo.
base::LogLevel LevelOf(absl::StatusCode code, base::LogLevel if_ok);

}  // namespace liquidblend::server
