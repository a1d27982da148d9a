#include "core/trace/otlp.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace liquidblend::trace {
namespace {

using nlohmann::json;

SpanRecord MakeSpan() {
  SpanRecord span;
  span.context = {0x4bf92f3577b34da6, 0xa3ce929d0e0e4736, 0xf067aa0ba902b7, true, ""};
  span.name = "liquidblend.v1.LiquidBlend/GetFrame";
  span.kind = SpanKind::kServer;
  span.begin = absl::FromUnixNanos(1'700'000'000'123'456'789);
  span.end = span.begin + absl::Nanoseconds(1000);
  return span;
}

// By opentelemetry-proto 1: ids are hexadecimal, 64-bit numbers are text, enums are numbers.
TEST(OtlpJson, IsARequestByTheSpecification) {
  SpanRecord span = MakeSpan();
  span.parent_id = 0xb7ad6b7169203331;
  span.context.state = "vendor=1";
  span.attributes = {
      {"text", std::string("a \"b\"")}, {"number", int64_t{-5}}, {"real", 0.5}, {"flag", true}};
  span.events = {
      {"resumed", absl::FromUnixNanos(1'700'000'000'123'457'000), {{"iteration", int64_t{7}}}}};
  span.num_dropped_attributes = 2;
  span.num_dropped_events = 3;
  span.has_failed = true;
  span.error = "no such thing";
  const Resource resource = {{{"service.name", std::string("liquidblend-server")}}, "0.2.0"};
  EXPECT_EQ(json::parse(ToOtlpJson(resource, {span})), json::parse(R"({
    "resourceSpans": [{
      "resource": {"attributes": [
        {"key": "service.name", "value": {"stringValue": "liquidblend-server"}}]},
      "scopeSpans": [{
        "scope": {"name": "liquidblend", "version": "0.2.0"},
        "spans": [{
          "traceId": "4bf92f3577b34da6a3ce929d0e0e4736",
          "spanId": "00f067aa0ba902b7",
          "traceState": "vendor=1",
          "parentSpanId": "b7ad6b7169203331",
          "name": "liquidblend.v1.LiquidBlend/GetFrame",
          "kind": 2,
          "startTimeUnixNano": "1700000000123456789",
          "endTimeUnixNano": "1700000000123457789",
          "attributes": [
            {"key": "text", "value": {"stringValue": "a \"b\""}},
            {"key": "number", "value": {"intValue": "-5"}},
            {"key": "real", "value": {"doubleValue": 0.5}},
            {"key": "flag", "value": {"boolValue": true}}],
          "droppedAttributesCount": 2,
          "events": [{
            "timeUnixNano": "1700000000123457000",
            "name": "resumed",
            "attributes": [{"key": "iteration", "value": {"intValue": "7"}}]}],
          "droppedEventsCount": 3,
          "status": {"message": "no such thing", "code": 2}}]}]}]})"));
}

TEST(OtlpJson, LeavesOutWhatASpanDoesNotHave) {
  const json request = json::parse(ToOtlpJson({}, {MakeSpan(), MakeSpan()}));
  const json& spans = request["resourceSpans"][0]["scopeSpans"][0]["spans"];
  ASSERT_EQ(spans.size(), 2U);
  for (const char* name : {"parentSpanId", "traceState", "status", "events",
                           "droppedAttributesCount", "droppedEventsCount"}) {
    EXPECT_FALSE(spans[1].contains(name)) << name;
  }
  EXPECT_EQ(spans[1]["attributes"], json::array());
}

TEST(OtlpJson, BytesThatAreNotUtf8AreReplaced) {
  SpanRecord span = MakeSpan();
  span.name = "a\xFF";
  const json request = json::parse(ToOtlpJson({}, {span}));
  EXPECT_EQ(request["resourceSpans"][0]["scopeSpans"][0]["spans"][0]["name"], "a\xEF\xBF\xBD");
}

TEST(NumRejected, IsWhatTheCollectorSays) {
  EXPECT_EQ(NumRejected(R"({"partialSuccess":{"rejectedSpans":"5","errorMessage":"old"}})"), 5);
  EXPECT_EQ(NumRejected(R"({"partialSuccess":{"rejectedSpans":5}})"), 5);
  for (const char* answer :
       {"", "{}", "[]", "not JSON", R"({"partialSuccess":{}})", R"({"partialSuccess":5})",
        R"({"partialSuccess":{"rejectedSpans":"many"}})",
        R"({"partialSuccess":{"rejectedSpans":-5}})",
        R"({"partialSuccess":{"rejectedSpans":[1]}})"}) {
    EXPECT_EQ(NumRejected(answer), 0) << answer;
  }
}

}  // namespace
}  // namespace liquidblend::trace
