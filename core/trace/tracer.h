// Tracer of a program: begins its spans, and exports them by OTLP over HTTP.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "absl/strings/string_view.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "core/trace/context.h"
#include "core/trace/exporter.h"
#include "core/trace/options.h"
#include "core/trace/span.h"

namespace liquidblend::trace {

// Threads: safe, but for Stop().
class Tracer {
 public:
  // A tracer that records nothing.
  Tracer() = default;
  // A tracer that exports from now on. Without a url it records nothing.
  Tracer(const TracerOptions& options, Report report);

  // Returns the tracer of the program's environment; warnings about that are reported.
  static std::unique_ptr<Tracer> Open(const Program& program, const Report& report);

  // Whether spans are recorded at all. If not, callers need not assemble names and attributes.
  bool is_on() const { return queue_ != nullptr; }

  // Begins a span with the parent of another program, or a trace if `parent` is invalid. What the
  // sampler or the rate leaves out is not recorded, and neither are its children.
  Span StartSpan(absl::string_view name, SpanKind kind, const SpanContext& parent,
                 absl::Time begin = absl::Now()) const noexcept;

  SpanStats stats() const;

  // Exports the spans that have ended, for as long as `patience`; later ones are dropped.
  static constexpr absl::Duration kPatience = absl::Seconds(1);
  void Stop(absl::Duration patience = kPatience);

 private:
  Span Start(absl::string_view name, SpanKind kind, const SpanContext& parent,
             absl::Time begin) const;

  Sampler sampler_;
  std::shared_ptr<SpanQueue> queue_;  // null: off
  std::unique_ptr<Exporter> exporter_;
};

// Whether the sampler records a span with this context, which has the flag of its parent.
bool IsSampled(const Sampler& sampler, const SpanContext& context, bool has_parent);

}  // namespace liquidblend::trace
