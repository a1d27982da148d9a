// Spans as OTLP/HTTP's JSON: an ExportTraceServiceRequest of opentelemetry-proto by protobuf's
// mapping, with ids in hexadecimal digits and enums as numbers.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/trace/span_record.h"

namespace liquidblend::trace {

// The program that made the spans.
struct Resource {
  Attributes attributes;  // service.name and the like
  std::string version;    // of the program
};

// The body of a request. Bytes that are not UTF-8 are replaced.
std::string ToOtlpJson(const Resource& resource, const std::vector<SpanRecord>& spans);

// The number of spans that the collector's answer says it has not taken; 0 if it does not say so.
int64_t NumRejected(const std::string& answer);

}  // namespace liquidblend::trace
