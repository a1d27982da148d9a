// Trace of a command: its span, which all of its calls are within.
#pragma once

#include <memory>
#include <string>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/synchronization/mutex.h"
#include "core/trace/tracer.h"
#include "liquidblend/client.h"

namespace liquidblend::cli {

// The environment has the variables of trace::ReadEnvironment(), and TRACEPARENT and TRACESTATE of
// whoever runs the command. A command that calls no server has no span.
// Threads: HeadersOfCall() from any, the others from one.
class CommandTrace {
 public:
  // `report` takes lines about spans that cannot be sent, from any thread.
  explicit CommandTrace(trace::Report report) : report_(std::move(report)) {}

  // Trace headers of a call: the command's span, which begins with the first call; if it is not
  // recorded, those of the environment.
  TraceHeaders HeadersOfCall();

  // Ends the span, and exports it.
  void End(const std::string& command, const absl::Status& status);

 private:
  const trace::Report report_;
  const absl::Time begin_ = absl::Now();
  absl::Mutex mutex_;
  std::unique_ptr<trace::Tracer> tracer_ ABSL_GUARDED_BY(mutex_);  // null: no call was made
  trace::Span span_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace liquidblend::cli
