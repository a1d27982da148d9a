#include "core/trace/options.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"

namespace liquidblend::trace {
namespace {

constexpr char kTracesPath[] = "/v1/traces";
constexpr char kRateVariable[] = "LIQUIDBLEND_TRACE_SPANS_PER_SECOND";
constexpr int64_t kMostSpans = 1'000'000;
constexpr int64_t kLongestMs = 3'600'000;
constexpr double kHighestRate = 1e9;

using Pairs = std::vector<std::pair<std::string, std::string>>;

// An empty value counts as none.
std::string ValueOf(const std::string& name) {
  const char* const value = std::getenv(name.c_str());
  return value == nullptr ? "" : std::string(absl::StripAsciiWhitespace(value));
}

// That of traces, or that of all signals: OTEL_EXPORTER_OTLP_TRACES_HEADERS, .._OTLP_HEADERS.
std::string OtlpValueOf(const std::string& name) {
  const std::string of_traces = ValueOf(absl::StrCat("OTEL_EXPORTER_OTLP_TRACES_", name));
  return of_traces.empty() ? ValueOf(absl::StrCat("OTEL_EXPORTER_OTLP_", name)) : of_traces;
}

bool IsTrue(const std::string& name) { return absl::EqualsIgnoreCase(ValueOf(name), "true"); }

int DigitOf(char c) {
  if (!absl::ascii_isxdigit(static_cast<unsigned char>(c))) return -1;
  return absl::ascii_isdigit(static_cast<unsigned char>(c)) ? c - '0'
                                                            : absl::ascii_tolower(c) - 'a' + 10;
}

std::string DecodePercent(absl::string_view text) {
  std::string decoded;
  for (size_t k = 0; k < text.size(); ++k) {
    const bool is_escape = text[k] == '%' && k + 2 < text.size() && DigitOf(text[k + 1]) >= 0 &&
                           DigitOf(text[k + 2]) >= 0;
    if (!is_escape) {
      decoded += text[k];
      continue;
    }
    decoded += static_cast<char>(DigitOf(text[k + 1]) * 16 + DigitOf(text[k + 2]));
    k += 2;
  }
  return decoded;
}

bool HasControls(absl::string_view text) {
  return std::any_of(text.begin(), text.end(),
                     [](char c) { return absl::ascii_iscntrl(static_cast<unsigned char>(c)); });
}

// Reads the environment, and gathers warnings on the way.
class Reader {
 public:
  explicit Reader(const Program& program) : program_(program) {}

  TracingEnvironment Read() {
    options_.url = Url();
    if (options_.url.empty()) return std::move(result_);  // what the others say is of no matter
    CheckProtocol();
    options_.headers = PairsOf("OTEL_EXPORTER_OTLP_HEADERS", OtlpValueOf("HEADERS"));
    options_.ca_file = OtlpValueOf("CERTIFICATE");
    options_.timeout =
        Milliseconds("OTEL_EXPORTER_OTLP_TIMEOUT", OtlpValueOf("TIMEOUT"), 1, options_.timeout);
    options_.delay = Milliseconds("OTEL_BSP_SCHEDULE_DELAY", ValueOf("OTEL_BSP_SCHEDULE_DELAY"), 0,
                                  options_.delay);
    options_.queue.max_spans = Count("OTEL_BSP_MAX_QUEUE_SIZE", options_.queue.max_spans);
    options_.batch_spans = Count("OTEL_BSP_MAX_EXPORT_BATCH_SIZE", options_.batch_spans);
    SetRate();
    SetSampler();
    SetResource();
    return std::move(result_);
  }

 private:
  void Warn(const std::string& variable, const std::string& why) {
    result_.warnings.push_back(absl::StrCat(variable, " ", why));
  }

  // URL of the collector; empty: nothing is to be recorded.
  std::string Url() {
    if (IsTrue("OTEL_SDK_DISABLED")) return "";
    const std::string exporter = ValueOf("OTEL_TRACES_EXPORTER");
    if (exporter == "none") return "";
    if (!exporter.empty() && exporter != "otlp") {
      Warn("OTEL_TRACES_EXPORTER", absl::StrCat("is '", exporter, "'; there are otlp and none"));
      return "";
    }
    std::string url = ValueOf("OTEL_EXPORTER_OTLP_TRACES_ENDPOINT");
    if (url.empty()) {
      url = ValueOf("OTEL_EXPORTER_OTLP_ENDPOINT");
      if (url.empty()) return "";
      url = absl::StrCat(absl::StripSuffix(url, "/"), kTracesPath);
    }
    if (absl::StartsWith(url, "http://") || absl::StartsWith(url, "https://")) return url;
    Warn("OTEL_EXPORTER_OTLP_ENDPOINT", "must begin with http:// or https://; no spans are sent");
    return "";
  }

  // Collectors tell JSON from protobuf by its type, but not gRPC.
  void CheckProtocol() {
    const std::string protocol = OtlpValueOf("PROTOCOL");
    if (protocol.empty() || absl::StartsWith(protocol, "http/")) return;
    Warn("OTEL_EXPORTER_OTLP_PROTOCOL",
         absl::StrCat("is '", protocol, "'; spans are sent as http/json"));
  }

  // "a=1,b=2", with escapes like %2C in values.
  Pairs PairsOf(const std::string& variable, const std::string& text) {
    Pairs pairs;
    for (const absl::string_view item : absl::StrSplit(text, ',', absl::SkipWhitespace())) {
      const std::pair<absl::string_view, absl::string_view> pair =
          absl::StrSplit(item, absl::MaxSplits('=', 1));
      const std::string name(absl::StripAsciiWhitespace(pair.first));
      const std::string value = DecodePercent(absl::StripAsciiWhitespace(pair.second));
      if (name.empty() || !absl::StrContains(item, '=') || HasControls(name) ||
          HasControls(value)) {
        Warn(variable, "has an item that is not NAME=VALUE");  // which may be a secret
      } else {
        pairs.emplace_back(name, value);
      }
    }
    return pairs;
  }

  int64_t Integer(const std::string& variable, const std::string& text, int64_t least, int64_t most,
                  int64_t otherwise) {
    if (text.empty()) return otherwise;
    int64_t value = 0;
    if (absl::SimpleAtoi(text, &value) && value >= least && value <= most) return value;
    Warn(variable, absl::StrCat("is '", text, "', not from ", least, " to ", most));
    return otherwise;
  }

  absl::Duration Milliseconds(const std::string& variable, const std::string& text, int64_t least,
                              absl::Duration otherwise) {
    return absl::Milliseconds(
        Integer(variable, text, least, kLongestMs, absl::ToInt64Milliseconds(otherwise)));
  }

  size_t Count(const std::string& variable, size_t otherwise) {
    return static_cast<size_t>(
        Integer(variable, ValueOf(variable), 1, kMostSpans, static_cast<int64_t>(otherwise)));
  }

  // A number of [0, most], or `otherwise`.
  double Number(const std::string& variable, double most, double otherwise) {
    const std::string text = ValueOf(variable);
    double value = 0;
    if (text.empty()) return otherwise;
    if (absl::SimpleAtod(text, &value) && value >= 0 && value <= most) return value;
    Warn(variable, absl::StrCat("is '", text, "', not from 0 to ", most));
    return otherwise;
  }

  void SetRate() {
    options_.queue.max_per_second =
        Number(kRateVariable, kHighestRate, options_.queue.max_per_second);
  }

  void SetSampler() {
    const std::string name = ValueOf("OTEL_TRACES_SAMPLER");
    if (name.empty()) return;
    absl::string_view root = name;
    options_.sampler.by_parent = absl::ConsumePrefix(&root, "parentbased_");
    if (root == "always_on") return;
    if (root == "always_off") {
      options_.sampler.ratio = 0;
    } else if (root == "traceidratio") {
      options_.sampler.ratio = Number("OTEL_TRACES_SAMPLER_ARG", 1, 1);
    } else {
      options_.sampler = Sampler();
      Warn("OTEL_TRACES_SAMPLER", absl::StrCat("is '", name, "', which is none of those known"));
    }
  }

  void SetResource() {
    Resource& resource = options_.resource;
    resource.version = program_.version;
    const std::string service = ValueOf("OTEL_SERVICE_NAME");
    std::array<char, 256> host = {};
    if (gethostname(host.data(), host.size() - 1) != 0) host = {};
    const std::string host_name = host.data();
    Pairs pairs = {{"service.name", service.empty() ? program_.name : service},
                   {"service.version", program_.version},
                   {"service.instance.id", absl::StrCat(host_name, ":", getpid())},
                   {"host.name", host_name},
                   {"process.executable.name", program_.name}};
    const std::string variable = "OTEL_RESOURCE_ATTRIBUTES";
    for (auto& [name, value] : PairsOf(variable, ValueOf(variable))) {
      if (name == "service.name" && !service.empty()) continue;
      const auto same = std::find_if(pairs.begin(), pairs.end(),
                                     [&key = name](const auto& pair) { return pair.first == key; });
      if (same != pairs.end()) same->second = value;
      if (same == pairs.end()) pairs.emplace_back(name, value);
    }
    for (auto& [name, value] : pairs) resource.attributes.emplace_back(name, std::move(value));
    resource.attributes.emplace_back("process.pid", int64_t{getpid()});
  }

  const Program& program_;
  TracingEnvironment result_;
  TracerOptions& options_ = result_.options;
};

}  // namespace

TracingEnvironment ReadEnvironment(const Program& program) { return Reader(program).Read(); }

}  // namespace liquidblend::trace
