// Options of tracing, by the environment variables that OpenTelemetry defines. What is not said
// here is in docs/operations/tracing.md.
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "absl/time/time.h"
#include "core/trace/otlp.h"
#include "core/trace/span_queue.h"

namespace liquidblend::trace {

// Decides about a span without a parent in this program whether it is recorded.
struct Sampler {
  double ratio = 1.0;     // [0, 1]; of the traces, by their ids
  bool by_parent = true;  // a span whose parent is in another program is recorded if that one is
};

struct TracerOptions {
  std::string url;  // of the collector, http:// or https://; empty: nothing is recorded
  std::vector<std::pair<std::string, std::string>> headers;  // of requests to it
  std::string ca_file;                                       // for https; empty: the system's
  absl::Duration timeout = absl::Seconds(10);                // > 0; of a request
  Sampler sampler;
  SpanQueueOptions queue;
  size_t batch_spans = 512;                 // >= 1; of a request
  absl::Duration delay = absl::Seconds(5);  // >= 0; how long a span waits for more
  Resource resource;
};

// The program that reads them.
struct Program {
  std::string name;     // "liquidblend-server"; the service's, unless the environment has another
  std::string version;  // base::Version()
};

struct TracingEnvironment {
  TracerOptions options;
  std::vector<std::string> warnings;  // of values that are not understood, and count as not given
};

// Reads the environment. Without an endpoint there is no url.
// Threads: safe as long as nobody changes the environment.
TracingEnvironment ReadEnvironment(const Program& program);

}  // namespace liquidblend::trace
