// A text that is made when it is first needed.
#pragma once

#include <optional>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"

namespace liquidblend::server {

// Threads: safe.
class LazyText {
 public:
  // The text, which make() gives at the first call; others wait for it. If make() throws, so does
  // this, and the next call makes it. (absl::call_once() would lock all later calls out.)
  template <typename Make>
  const std::string& Of(Make&& make) const {
    absl::MutexLock lock(&mutex_);
    if (!text_.has_value()) text_ = make();
    return *text_;
  }

 private:
  mutable absl::Mutex mutex_;
  mutable std::optional<std::string> text_ ABSL_GUARDED_BY(mutex_);  // once made it stays
};

}  // namespace liquidblend::server
