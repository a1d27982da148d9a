#include "core/trace/otlp.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"

namespace liquidblend::trace {
namespace {

// The JSON is put together as text: a tree of its values takes eight times as long, and a frame has
// six spans.
constexpr char kScope[] = "liquidblend";
constexpr int kStatusError = 2;

bool IsPlain(char c) { return c >= ' ' && c <= '~' && c != '"' && c != '\\'; }

void AppendText(const std::string& text, std::string& json) {
  if (std::all_of(text.begin(), text.end(), IsPlain)) {
    absl::StrAppend(&json, "\"", text, "\"");
  } else {
    json += nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  }
}

// Calls `append(value)` for each value, with a comma between two.
template <typename Values, typename Append>
void AppendList(const Values& values, std::string& json, const Append& append) {
  json += '[';
  const size_t begin = json.size();
  for (const auto& value : values) {
    if (json.size() > begin) json += ',';
    append(value);
  }
  json += ']';
}

void AppendValue(const AttributeValue& value, std::string& json) {
  if (const auto* const text = std::get_if<std::string>(&value)) {
    json += "{\"stringValue\":";
    AppendText(*text, json);
  } else if (const auto* const number = std::get_if<int64_t>(&value)) {
    absl::StrAppend(&json, "{\"intValue\":\"", *number, "\"");  // as protobuf has int64
  } else if (const auto* const real = std::get_if<double>(&value)) {
    absl::StrAppend(&json, "{\"doubleValue\":", nlohmann::json(*real).dump());
  } else {
    absl::StrAppend(&json, "{\"boolValue\":", std::get<bool>(value) ? "true" : "false");
  }
  json += '}';
}

void AppendAttributes(const Attributes& attributes, std::string& json) {
  json += "\"attributes\":";
  AppendList(attributes, json, [&](const auto& attribute) {
    json += "{\"key\":";
    AppendText(attribute.first, json);
    json += ",\"value\":";
    AppendValue(attribute.second, json);
    json += '}';
  });
}

void AppendEvent(const SpanEvent& event, std::string& json) {
  absl::StrAppend(&json, "{\"timeUnixNano\":\"", absl::ToUnixNanos(event.time), "\",\"name\":");
  AppendText(event.name, json);
  json += ',';
  AppendAttributes(event.attributes, json);
  json += '}';
}

// What the span was about, after its identity.
void AppendContent(const SpanRecord& span, std::string& json) {
  AppendAttributes(span.attributes, json);
  if (span.num_dropped_attributes > 0) {
    absl::StrAppend(&json, ",\"droppedAttributesCount\":", span.num_dropped_attributes);
  }
  if (!span.events.empty()) {
    json += ",\"events\":";
    AppendList(span.events, json, [&](const SpanEvent& event) { AppendEvent(event, json); });
  }
  if (span.num_dropped_events > 0) {
    absl::StrAppend(&json, ",\"droppedEventsCount\":", span.num_dropped_events);
  }
  if (span.has_failed) {
    json += ",\"status\":{\"message\":";
    AppendText(span.error, json);
    absl::StrAppend(&json, ",\"code\":", kStatusError, "}");
  }
}

void AppendSpan(const SpanRecord& span, std::string& json) {
  absl::StrAppend(&json, "{\"traceId\":\"", TraceIdOf(span.context), "\",\"spanId\":\"",
                  SpanIdOf(span.context), "\"");
  if (!span.context.state.empty()) {
    json += ",\"traceState\":";
    AppendText(span.context.state, json);
  }
  if (span.parent_id != 0) {
    absl::StrAppend(&json, ",\"parentSpanId\":\"", ToHex(span.parent_id), "\"");
  }
  json += ",\"name\":";
  AppendText(span.name, json);
  absl::StrAppend(&json, ",\"kind\":", static_cast<int>(span.kind), ",\"startTimeUnixNano\":\"",
                  absl::ToUnixNanos(span.begin), "\",\"endTimeUnixNano\":\"",
                  absl::ToUnixNanos(span.end), "\",");
  AppendContent(span, json);
  json += '}';
}

}  // namespace

std::string ToOtlpJson(const Resource& resource, const std::vector<SpanRecord>& spans) {
  std::string json = "{\"resourceSpans\":[{\"resource\":{";
  AppendAttributes(resource.attributes, json);
  absl::StrAppend(&json, "},\"scopeSpans\":[{\"scope\":{\"name\":\"", kScope, "\",\"version\":");
  AppendText(resource.version, json);
  json += "},\"spans\":";
  AppendList(spans, json, [&](const SpanRecord& span) { AppendSpan(span, json); });
  return json + "}]}]}";
}

int64_t NumRejected(const std::string& answer) {
  const auto json = nlohmann::json::parse(answer, nullptr, /*allow_exceptions=*/false);
  const nlohmann::json::json_pointer place("/partialSuccess/rejectedSpans");
  if (!json.is_object() || !json.contains(place)) return 0;
  const nlohmann::json& value = json[place];  // an int64, which is text in protobuf's mapping
  int64_t number = 0;
  if (value.is_string() && !absl::SimpleAtoi(value.get<std::string>(), &number)) return 0;
  if (value.is_number_integer()) number = value.get<int64_t>();
  return std::max<int64_t>(number, 0);
}

}  // namespace liquidblend::trace
