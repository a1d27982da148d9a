// The lines that tell of calls, whichever way they came. A client whose calls go wrong again and
// again cannot flood the log.
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

// A call that is over.
struct EndedCall {
  base::LogFields how;  // what was called and what became of it, e.g. method and code
  base::LogLevel level = base::LogLevel::kInfo;
  absl::Duration took;
  Caller caller;
  std::string resource;  // animations/{id} and the like, or empty
  std::string error;     // empty: it went well
};

// One line a call. Of those of one client (a principal, or a host) that went wrong within a second,
// the first kMaxLines have one, and then one line counts the others.  Threads: safe.
class CallLog {
 public:
  static constexpr int kMaxLines = 10;
  static constexpr absl::Duration kWindow = absl::Seconds(1);

  using Later = std::function<void(absl::Duration delay, std::function<void()> work)>;

  // `later` runs work after a while, or never; not after this is destroyed.
  explicit CallLog(Later later) : later_(std::move(later)) {}
  ~CallLog() { Flush(); }

  void Tell(const EndedCall& call);

  // Tells of all that has been counted, before its time.
  void Flush();

 private:
  // A second in which calls of a client went wrong.
  struct Window {
    int64_t num_calls = 0;
    base::LogFields last;  // of those that are counted
    base::LogLevel worst = base::LogLevel::kDebug;
  };

  bool MayTell(const EndedCall& call);
  void Close(const std::string& client);

  const Later later_;
  absl::Mutex mutex_;
  std::map<std::string, Window> windows_ ABSL_GUARDED_BY(mutex_);  // by client
};

// What the operator should look at, and what is of interest when searching: kError for what should
// not happen, `if_ok` if it went well, otherwise kInfo.
base::LogLevel LevelOf(absl::StatusCode code, base::LogLevel if_ok);

}  // namespace liquidblend::server
