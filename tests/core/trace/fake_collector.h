// Collector of spans for tests: takes OTLP as JSON over HTTP, as an OpenTelemetry collector does.
#pragma once

#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"
#include "core/trace/tracer.h"
#include "tests/core/store/blobs/http_fake.h"

namespace liquidblend::trace {

// A span as it arrived.
struct CollectedSpan {
  std::string service;  // service.name of its resource
  std::string trace_id;
  std::string span_id;
  std::string parent_id;  // empty: none
  std::string state;
  std::string name;
  int kind = 0;
  int64_t begin_ns = 0;
  int64_t end_ns = 0;
  std::map<std::string, std::string> attributes;  // values as text
  std::vector<std::string> events;                // their names
  bool has_failed = false;
  std::string error;
};

// On any free port of 127.0.0.1.  Threads: safe.
class FakeCollector {
 public:
  FakeCollector();

  std::string url() const { return http_.url(); }  // OTEL_EXPORTER_OTLP_ENDPOINT
  // Of a tracer that sends what has ended here, at once.
  TracerOptions Options(const std::string& service = "test") const;

  // The next requests get this status instead, so many times.
  void FailNext(int times, int status);

  // All that have arrived. Malformed requests fail the test.
  std::vector<CollectedSpan> Spans();
  int num_requests() { return http_.num_requests(); }
  std::map<std::string, std::string> LastHeaders();  // names in lower case

  // Waits until the spans are as wanted, a minute at most; returns them.
  std::vector<CollectedSpan> Await(
      const std::function<bool(const std::vector<CollectedSpan>&)>& is_wanted);
  // Likewise, until there are spans of all of these names.
  std::vector<CollectedSpan> AwaitNames(const std::set<std::string>& names);

 private:
  store::HttpFake::Answer Take(const store::HttpFake::Request& request);

  absl::Mutex mutex_;
  std::vector<CollectedSpan> spans_ ABSL_GUARDED_BY(mutex_);
  std::map<std::string, std::string> headers_ ABSL_GUARDED_BY(mutex_);
  int num_failures_ ABSL_GUARDED_BY(mutex_) = 0;
  int failure_status_ ABSL_GUARDED_BY(mutex_) = 0;
  store::HttpFake http_;
};

// The first span of that name; fails the test if there is none.
CollectedSpan FindSpan(const std::vector<CollectedSpan>& spans, const std::string& name);

// Environment of a program that exports to that collector, as NAME=VALUE.
std::vector<std::string> EnvironmentOf(const FakeCollector& collector);

}  // namespace liquidblend::trace
