// Trace contexts by the W3C's recommendation "Trace Context": which trace and span a call or a job
// belongs to, as text that travels between programs.
#pragma once

#include <cstdint>
#include <string>

#include "absl/strings/string_view.h"

namespace liquidblend::trace {

// Names of the headers (HTTP) and metadata (gRPC) of a call.
inline constexpr char kTraceparent[] = "traceparent";
inline constexpr char kTracestate[] = "tracestate";

// Identity of a span.
struct SpanContext {
  uint64_t trace_high = 0;  // id of the trace; both 0: there is none
  uint64_t trace_low = 0;
  uint64_t span_id = 0;
  bool is_sampled = false;  // the caller records its spans
  std::string state;        // tracestate of other systems, passed on as it is

  bool is_valid() const { return (trace_high | trace_low) != 0 && span_id != 0; }
};

// The context in a call's headers, which may hold anything. An invalid one if `traceparent` is not
// by the recommendation. A `tracestate` that has more than 512 bytes, or others than printable
// ASCII, is left out.
SpanContext ParseContext(absl::string_view traceparent, absl::string_view tracestate = "");

// The header `traceparent`, version 00; "" of an invalid context.
std::string ToTraceparent(const SpanContext& context);

// 32 and 16 hexadecimal digits; "" of an invalid context.
std::string TraceIdOf(const SpanContext& context);
std::string SpanIdOf(const SpanContext& context);

// 16 hexadecimal digits.
std::string ToHex(uint64_t id);

// A random number other than 0, from the system's generator.  Threads: safe.
uint64_t RandomId();

}  // namespace liquidblend::trace
