#include "core/trace/tracer.h"

#include <cmath>
#include <exception>
#include <utility>

namespace liquidblend::trace {

Tracer::Tracer(const TracerOptions& options, Report report) : sampler_(options.sampler) {
  if (options.url.empty()) return;
  queue_ = std::make_shared<SpanQueue>(options.queue);
  exporter_ = std::make_unique<Exporter>(options, queue_, std::move(report));
}

std::unique_ptr<Tracer> Tracer::Open(const Program& program, const Report& report) {
  const TracingEnvironment environment = ReadEnvironment(program);
  for (const std::string& warning : environment.warnings) report("traces: " + warning);
  return std::make_unique<Tracer>(environment.options, report);
}

Span Tracer::StartSpan(absl::string_view name, SpanKind kind, const SpanContext& parent,
                       absl::Time begin) const noexcept {
  try {
    return is_on() ? Start(name, kind, parent, begin) : Span(parent);
  } catch (const std::exception&) {  // no memory
    return {};
  }
}

Span Tracer::Start(absl::string_view name, SpanKind kind, const SpanContext& parent,
                   absl::Time begin) const {
  SpanRecord record;
  record.context = parent;
  if (!parent.is_valid()) {
    record.context = SpanContext();
    record.context.trace_high = RandomId();
    record.context.trace_low = RandomId();
  }
  record.context.span_id = RandomId();
  record.context.is_sampled = IsSampled(sampler_, record.context, parent.is_valid());
  if (!record.context.is_sampled || !queue_->Admit()) {
    SpanContext passed_on = parent.is_valid() ? parent : record.context;
    // A trace of another program goes on elsewhere if the rate alone leaves this span out.
    passed_on.is_sampled = parent.is_valid() && record.context.is_sampled;
    return Span(std::move(passed_on));
  }
  record.parent_id = parent.span_id;
  record.name = std::string(name);
  record.kind = kind;
  record.begin = begin;
  return Span(queue_, std::move(record));
}

SpanStats Tracer::stats() const { return is_on() ? queue_->stats() : SpanStats(); }

void Tracer::Stop(absl::Duration patience) {
  if (exporter_ != nullptr) exporter_->Stop(patience);
}

bool IsSampled(const Sampler& sampler, const SpanContext& context, bool has_parent) {
  if (has_parent && sampler.by_parent) return context.is_sampled;
  // The lowest 63 bits decide, as in OpenTelemetry's other programs, so that all agree on one
  // trace.
  constexpr int kBits = 63;
  const auto bound = static_cast<uint64_t>(std::ldexp(sampler.ratio, kBits));
  return context.trace_low >> 1 < bound;
}

}  // namespace liquidblend::trace
