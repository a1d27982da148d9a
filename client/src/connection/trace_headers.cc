#include "client/src/connection/trace_headers.h"

#include <algorithm>

namespace liquidblend::client {
namespace {

constexpr size_t kMaxBytes = 512;

bool CanBeSent(const std::string& value) {
  return !value.empty() && value.size() <= kMaxBytes &&
         std::all_of(value.begin(), value.end(), [](char c) { return c >= ' ' && c <= '~'; });
}

}  // namespace

void AddTrace(const TraceHeaders& trace, grpc::ClientContext* context) {
  if (!CanBeSent(trace.traceparent)) return;
  context->AddMetadata("traceparent", trace.traceparent);
  if (CanBeSent(trace.tracestate)) context->AddMetadata("tracestate", trace.tracestate);
}

}  // namespace liquidblend::client
