#include "core/trace/context.h"

#include <sys/random.h>

#include <algorithm>

#include "absl/strings/str_cat.h"

namespace liquidblend::trace {
namespace {

// "00-" trace id "-" span id "-" flags.
constexpr size_t kSpanIdAt = 3 + 32 + 1;
constexpr size_t kFlagsAt = kSpanIdAt + 16 + 1;
constexpr size_t kLength = kFlagsAt + 2;
constexpr size_t kMaxStateBytes = 512;
constexpr uint64_t kSampledFlag = 1;
constexpr uint64_t kInvalidVersion = 0xFF;

// Reads lower-case hexadecimal digits. False if there are others.
bool ReadHex(absl::string_view digits, uint64_t& value) {
  value = 0;
  for (const char c : digits) {
    const bool is_digit = c >= '0' && c <= '9';
    if (!is_digit && (c < 'a' || c > 'f')) return false;
    value = value << 4 | static_cast<uint64_t>(is_digit ? c - '0' : c - 'a' + 10);
  }
  return true;
}

// Versions to come may add to the end.
bool HasLengthOf(uint64_t version, absl::string_view text) {
  return text.size() == kLength || (version > 0 && text.size() > kLength && text[kLength] == '-');
}

bool IsPrintable(absl::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return c >= ' ' && c <= '~'; });
}

}  // namespace

SpanContext ParseContext(absl::string_view traceparent, absl::string_view tracestate) {
  const absl::string_view text = traceparent;
  if (text.size() < kLength || text[2] != '-' || text[kSpanIdAt - 1] != '-' ||
      text[kFlagsAt - 1] != '-') {
    return {};
  }
  SpanContext context;
  uint64_t version = 0;
  uint64_t flags = 0;
  const bool is_hex = ReadHex(text.substr(0, 2), version) &&
                      ReadHex(text.substr(3, 16), context.trace_high) &&
                      ReadHex(text.substr(19, 16), context.trace_low) &&
                      ReadHex(text.substr(kSpanIdAt, 16), context.span_id) &&
                      ReadHex(text.substr(kFlagsAt, 2), flags);
  if (!is_hex || version == kInvalidVersion || !HasLengthOf(version, text)) return {};
  if (!context.is_valid()) return {};
  context.is_sampled = (flags & kSampledFlag) != 0;
  if (tracestate.size() <= kMaxStateBytes && IsPrintable(tracestate)) {
    context.state = std::string(tracestate);
  }
  return context;
}

std::string ToTraceparent(const SpanContext& context) {
  if (!context.is_valid()) return "";
  return absl::StrCat("00-", TraceIdOf(context), "-", SpanIdOf(context), "-",
                      context.is_sampled ? "01" : "00");
}

std::string TraceIdOf(const SpanContext& context) {
  if (!context.is_valid()) return "";
  return ToHex(context.trace_high) + ToHex(context.trace_low);
}

std::string SpanIdOf(const SpanContext& context) {
  return context.is_valid() ? ToHex(context.span_id) : "";
}

std::string ToHex(uint64_t id) { return absl::StrCat(absl::Hex(id, absl::kZeroPad16)); }

uint64_t RandomId() {
  uint64_t id = 0;
  // A call that is interrupted gives nothing.
  while (getrandom(&id, sizeof(id), 0) != sizeof(id) || id == 0) {
  }
  return id;
}

}  // namespace liquidblend::trace
