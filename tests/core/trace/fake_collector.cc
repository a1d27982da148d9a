#include "tests/core/trace/fake_collector.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"

namespace liquidblend::trace {
namespace {

using nlohmann::json;

constexpr char kDelay[] = "10";  // ms

std::string TextOf(const json& value) {
  const json& only = value.front();
  return only.is_string() ? only.get<std::string>() : only.dump();
}

std::map<std::string, std::string> AttributesOf(const json& list) {
  std::map<std::string, std::string> attributes;
  for (const json& attribute : list) {
    attributes[attribute.at("key")] = TextOf(attribute.at("value"));
  }
  return attributes;
}

CollectedSpan SpanOf(const json& span) {
  CollectedSpan collected;
  collected.trace_id = span.at("traceId");
  collected.span_id = span.at("spanId");
  collected.parent_id = span.value("parentSpanId", "");
  collected.state = span.value("traceState", "");
  collected.name = span.at("name");
  collected.kind = span.at("kind");
  collected.begin_ns = std::stoll(span.at("startTimeUnixNano").get<std::string>());
  collected.end_ns = std::stoll(span.at("endTimeUnixNano").get<std::string>());
  collected.attributes = AttributesOf(span.at("attributes"));
  const json events = span.value("events", json::array());
  for (const json& event : events) collected.events.push_back(event.at("name"));
  collected.has_failed = span.contains("status") && span["status"].at("code") == 2;
  if (collected.has_failed) collected.error = span["status"].at("message");
  return collected;
}

std::vector<CollectedSpan> SpansOf(const std::string& body) {
  std::vector<CollectedSpan> spans;
  const json request = json::parse(body);
  for (const json& group : request.at("resourceSpans")) {
    const auto resource = AttributesOf(group.at("resource").at("attributes"));
    for (const json& scope : group.at("scopeSpans")) {
      for (const json& span : scope.at("spans")) {
        spans.push_back(SpanOf(span));
        spans.back().service = resource.at("service.name");
      }
    }
  }
  return spans;
}

}  // namespace

FakeCollector::FakeCollector()
    : http_(store::HttpFake::Handler(
          [this](const store::HttpFake::Request& request) { return Take(request); })) {}

store::HttpFake::Answer FakeCollector::Take(const store::HttpFake::Request& request) {
  absl::MutexLock lock(&mutex_);
  headers_ = request.headers;
  EXPECT_EQ(request.method, "POST");
  EXPECT_EQ(request.path, "/v1/traces");
  if (num_failures_ > 0) {
    --num_failures_;
    return {failure_status_};
  }
  try {
    for (CollectedSpan& span : SpansOf(request.body)) spans_.push_back(std::move(span));
  } catch (const json::exception& error) {
    ADD_FAILURE() << error.what() << " in " << request.body;
    return {400};
  }
  return {200, "{}"};
}

TracerOptions FakeCollector::Options(const std::string& service) const {
  TracerOptions options;
  options.url = absl::StrCat(url(), "/v1/traces");
  options.delay = absl::ZeroDuration();
  options.resource.attributes = {{"service.name", service}};
  return options;
}

void FakeCollector::FailNext(int times, int status) {
  absl::MutexLock lock(&mutex_);
  num_failures_ = times;
  failure_status_ = status;
}

std::vector<CollectedSpan> FakeCollector::Spans() {
  absl::MutexLock lock(&mutex_);
  return spans_;
}

std::map<std::string, std::string> FakeCollector::LastHeaders() {
  absl::MutexLock lock(&mutex_);
  return headers_;
}

std::vector<CollectedSpan> FakeCollector::Await(
    const std::function<bool(const std::vector<CollectedSpan>&)>& is_wanted) {
  const auto holds = [&] {
    mutex_.AssertHeld();
    return is_wanted(spans_);
  };
  absl::MutexLock lock(&mutex_);
  EXPECT_TRUE(mutex_.AwaitWithTimeout(absl::Condition(&holds), absl::Minutes(1)))
      << spans_.size() << " spans have come";
  return spans_;
}

std::vector<CollectedSpan> FakeCollector::AwaitNames(const std::set<std::string>& names) {
  return Await([&](const std::vector<CollectedSpan>& spans) {
    std::set<std::string> missing = names;
    for (const CollectedSpan& span : spans) missing.erase(span.name);
    return missing.empty();
  });
}

CollectedSpan FindSpan(const std::vector<CollectedSpan>& spans, const std::string& name) {
  const auto found = std::find_if(spans.begin(), spans.end(),
                                  [&](const CollectedSpan& span) { return span.name == name; });
  if (found != spans.end()) return *found;
  ADD_FAILURE() << "there is no span " << name;
  return {};
}

std::vector<std::string> EnvironmentOf(const FakeCollector& collector) {
  return {absl::StrCat("OTEL_EXPORTER_OTLP_ENDPOINT=", collector.url()),
          absl::StrCat("OTEL_BSP_SCHEDULE_DELAY=", kDelay)};
}

}  // namespace liquidblend::trace
