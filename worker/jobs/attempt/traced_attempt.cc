#include "worker/jobs/attempt/traced_attempt.h"

#include <algorithm>
#include <utility>

#include "absl/time/time.h"
#include "core/store/catalog/job_records.h"

namespace liquidblend::jobs {
namespace {

// Names of few different values: the tasks of a job.
const char* NameOf(const store::pb::JobRecord& job) {
  if (job.has_import_animation()) return "import attempt";
  return job.has_register_target() ? "target registration attempt" : "registration attempt";
}

// How long the job has been in the queue before this attempt.
double SecondsQueued(const store::pb::JobRecord& job) {
  const absl::Duration wait = store::ToTime(job.start_time()) - store::ToTime(job.queue_time());
  return std::max(0.0, absl::ToDoubleSeconds(wait));
}

trace::SpanContext ContextOf(const store::pb::JobRecord& job) {
  return trace::ParseContext(job.traceparent(), job.tracestate());
}

}  // namespace

TracedAttempt::TracedAttempt(const trace::Tracer* tracer, const store::pb::JobRecord& job,
                             const std::string& worker) {
  if (tracer == nullptr) return;
  attempt_ = tracer->StartSpan(NameOf(job), trace::SpanKind::kConsumer, ContextOf(job));
  if (!attempt_.is_recording()) return;
  attempt_.SetAttribute("liquidblend.job", job.id());
  attempt_.SetAttribute("liquidblend.job.attempt", int64_t{store::AttemptNumber(job)});
  attempt_.SetAttribute("liquidblend.job.queue_s", SecondsQueued(job));
  attempt_.SetAttribute("liquidblend.worker", worker);
  attempt_.SetAttribute("liquidblend.resource", store::SubjectOf(job));
  attempt_.SetAttribute("liquidblend.principal", job.owner());
  if (job.has_register_target()) {
    attempt_.SetAttribute("liquidblend.target_index",
                          int64_t{job.register_target().target_index()});
  }
}

void TracedAttempt::BeginStage(absl::string_view name) {
  if (!attempt_.is_recording()) return;
  stage_.End();
  stage_ = attempt_.StartChild(name);
}

void TracedAttempt::NoteResumed(int iteration) const {
  stage_.AddEvent("resumed from a checkpoint", {{"liquidblend.iteration", int64_t{iteration}}});
}

void TracedAttempt::End(const absl::Status& outcome) {
  for (const trace::Span& span : {stage_, attempt_}) {
    if (!outcome.ok()) {
      span.SetAttribute("error.type", absl::StatusCodeToString(outcome.code()));
      span.SetError(outcome.message());
    }
    span.End();
  }
}

base::LogFields TraceFields(const store::pb::JobRecord& job) {
  const trace::SpanContext context = ContextOf(job);
  if (!context.is_valid()) return {};
  return {{"trace_id", trace::TraceIdOf(context)}};
}

}  // namespace liquidblend::jobs
