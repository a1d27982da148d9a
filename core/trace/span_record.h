// Records of spans that have ended, as they are exported.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "absl/time/time.h"
#include "core/trace/context.h"

namespace liquidblend::trace {

// Role of a span; the numbers are OTLP's.
enum class SpanKind {
  kInternal = 1,
  kServer = 2,    // of a call that is answered
  kClient = 3,    // of calls that are made
  kConsumer = 5,  // of a job that was queued
};

using AttributeValue = std::variant<std::string, int64_t, double, bool>;
using Attributes = std::vector<std::pair<std::string, AttributeValue>>;

// Something that happened within a span.
struct SpanEvent {
  std::string name;
  absl::Time time;
  Attributes attributes;
};

struct SpanRecord {
  SpanContext context;
  uint64_t parent_id = 0;  // 0: it begins the trace
  std::string name;
  SpanKind kind = SpanKind::kInternal;
  absl::Time begin;
  absl::Time end;
  Attributes attributes;
  std::vector<SpanEvent> events;
  int num_dropped_attributes = 0;  // beyond the limits of Span
  int num_dropped_events = 0;
  bool has_failed = false;
  std::string error;  // of one that has failed
};

}  // namespace liquidblend::trace
