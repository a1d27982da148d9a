// Open calls: running calls that may last.
#pragma once

#include <map>
#include <memory>
#include <optional>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/synchronization/mutex.h"

namespace liquidblend::server {

class OpenCall {
 public:
  virtual ~OpenCall() = default;
  // Ends the call with this status as soon as no write is under way; only the first end counts.
  virtual void Close(const absl::Status& status) = 0;
};

// The open calls, so that a stopping server can end them.  Threads: safe.
class OpenCalls {
 public:
  // A call that comes after CloseAll() is closed at once.
  void Add(const std::shared_ptr<OpenCall>& call);
  void Remove(const OpenCall* call);
  void CloseAll(const absl::Status& status);

 private:
  absl::Mutex mutex_;
  std::map<const OpenCall*, std::weak_ptr<OpenCall>> calls_ ABSL_GUARDED_BY(mutex_);
  std::optional<absl::Status> closed_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace liquidblend::server
