#include "client/cli/flags/command_trace.h"

#include <cstdlib>

#include "absl/strings/str_cat.h"
#include "core/base/version.h"

namespace liquidblend::cli {
namespace {

constexpr char kProgram[] = "liquidblend";

absl::string_view Variable(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? "" : value;
}

}  // namespace

TraceHeaders CommandTrace::HeadersOfCall() {
  absl::MutexLock lock(&mutex_);
  if (tracer_ == nullptr) {
    tracer_ = trace::Tracer::Open({kProgram, base::Version()}, report_);
    const trace::SpanContext parent =
        trace::ParseContext(Variable("TRACEPARENT"), Variable("TRACESTATE"));
    span_ = tracer_->StartSpan(kProgram, trace::SpanKind::kClient, parent, begin_);
  }
  return {trace::ToTraceparent(span_.context()), span_.context().state};
}

void CommandTrace::End(const std::string& command, const absl::Status& status) {
  absl::MutexLock lock(&mutex_);
  if (tracer_ == nullptr) return;
  span_.SetName(absl::StrCat(kProgram, " ", command));
  if (!status.ok()) {
    span_.SetAttribute("error.type", absl::StatusCodeToString(status.code()));
    span_.SetError(status.message());
  }
  span_.End();
  tracer_->Stop();
}

}  // namespace liquidblend::cli
