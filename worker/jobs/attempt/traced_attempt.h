// The span of an attempt at a job, and of the stage that is running.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "core/base/log.h"
#include "core/store/catalog/catalog.h"
#include "core/trace/tracer.h"

namespace liquidblend::jobs {

// Spans of one attempt: its own, a child of the call's that asked for the job, and one for each
// stage. A worker that is killed leaves only those of stages that had ended; the next attempt has
// its number.  Threads: one at a time.
class TracedAttempt {
 public:
  // `tracer` null: nothing is traced.
  TracedAttempt(const trace::Tracer* tracer, const store::pb::JobRecord& job,
                const std::string& worker);

  // Ends the stage before.
  void BeginStage(absl::string_view name);

  // Says that the stage goes on after this iteration of an earlier attempt.
  void NoteResumed(int iteration) const;

  // Ends all. An error is that of the stage which was running, too.
  void End(const absl::Status& outcome);

 private:
  trace::Span attempt_;
  trace::Span stage_;
};

// Fields of log lines about the job: its trace, if it has one.
base::LogFields TraceFields(const store::pb::JobRecord& job);

}  // namespace liquidblend::jobs
