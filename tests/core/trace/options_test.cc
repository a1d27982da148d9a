#include "core/trace/options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <unistd.h>

#include <set>
#include <string>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"

namespace liquidblend::trace {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Pair;
using testing::SizeIs;

class OptionsTest : public testing::Test {
 protected:
  OptionsTest() { Clear(); }
  ~OptionsTest() override { Clear(); }

  void Set(const std::string& name, const std::string& value) {
    setenv(name.c_str(), value.c_str(), 1);
  }

  static TracingEnvironment Read() { return ReadEnvironment({"liquidblend-test", "1.2.3"}); }

  // With an endpoint, which the others need.
  TracerOptions ReadWith(const std::string& name, const std::string& value) {
    Set("OTEL_EXPORTER_OTLP_ENDPOINT", "http://collector:4318");
    Set(name, value);
    const TracingEnvironment environment = Read();
    EXPECT_THAT(environment.warnings, IsEmpty());
    unsetenv(name.c_str());
    return environment.options;
  }

  std::string WarningFor(const std::string& name, const std::string& value) {
    Set("OTEL_EXPORTER_OTLP_ENDPOINT", "http://collector:4318");
    Set(name, value);
    const TracingEnvironment environment = Read();
    unsetenv(name.c_str());
    EXPECT_THAT(environment.warnings, SizeIs(1)) << name << "=" << value;
    return environment.warnings.empty() ? "" : environment.warnings[0];
  }

 private:
  static void Clear() {
    std::set<std::string> names;
    for (char** variable = environ; *variable != nullptr; ++variable) {
      const std::string name = std::string(*variable).substr(0, std::string(*variable).find('='));
      const bool is_ours =
          absl::StartsWith(name, "OTEL_") || absl::StartsWith(name, "LIQUIDBLEND_TRACE_");
      if (is_ours) names.insert(name);
    }
    for (const std::string& name : names) unsetenv(name.c_str());
  }
};

TEST_F(OptionsTest, WithoutAnEndpointNothingIsRecorded) {
  EXPECT_EQ(Read().options.url, "");
  Set("OTEL_TRACES_SAMPLER", "nonsense");
  EXPECT_THAT(Read().warnings, IsEmpty());
}

TEST_F(OptionsTest, TheEndpointIsThatOfAllSignalsOrOfTraces) {
  EXPECT_EQ(ReadWith("A", "").url, "http://collector:4318/v1/traces");
  EXPECT_EQ(ReadWith("OTEL_EXPORTER_OTLP_ENDPOINT", "https://c/otlp/").url,
            "https://c/otlp/v1/traces");
  EXPECT_EQ(ReadWith("OTEL_EXPORTER_OTLP_TRACES_ENDPOINT", "http://c/api").url, "http://c/api");
  EXPECT_THAT(WarningFor("OTEL_EXPORTER_OTLP_TRACES_ENDPOINT", "collector:4318"),
              HasSubstr("http://"));
}

TEST_F(OptionsTest, StandardSwitchesTurnItOff) {
  EXPECT_EQ(ReadWith("OTEL_SDK_DISABLED", "true").url, "");
  EXPECT_EQ(ReadWith("OTEL_TRACES_EXPORTER", "none").url, "");
  EXPECT_NE(ReadWith("OTEL_TRACES_EXPORTER", "otlp").url, "");
  EXPECT_NE(ReadWith("OTEL_SDK_DISABLED", "false").url, "");
  EXPECT_THAT(WarningFor("OTEL_TRACES_EXPORTER", "zipkin"), HasSubstr("'zipkin'"));
}

TEST_F(OptionsTest, HeadersAreDecoded) {
  const TracerOptions options =
      ReadWith("OTEL_EXPORTER_OTLP_HEADERS", "Authorization=Basic%20abc==, x-scope = a%2Cb");
  EXPECT_THAT(options.headers,
              ElementsAre(Pair("Authorization", "Basic abc=="), Pair("x-scope", "a,b")));
  EXPECT_THAT(ReadWith("OTEL_EXPORTER_OTLP_TRACES_HEADERS", "a=100%").headers,
              ElementsAre(Pair("a", "100%")));
  for (const char* bad : {"secret", "=secret", "a=secret%0d%0aHost: x"}) {
    const std::string warning = WarningFor("OTEL_EXPORTER_OTLP_HEADERS", bad);
    EXPECT_THAT(warning, HasSubstr("NAME=VALUE"));
    EXPECT_THAT(warning, testing::Not(HasSubstr("secret")));
  }
}

TEST_F(OptionsTest, NumbersHaveRanges) {
  EXPECT_EQ(ReadWith("OTEL_EXPORTER_OTLP_TIMEOUT", "1500").timeout, absl::Milliseconds(1500));
  EXPECT_EQ(ReadWith("OTEL_BSP_SCHEDULE_DELAY", "0").delay, absl::ZeroDuration());
  EXPECT_EQ(ReadWith("OTEL_BSP_MAX_QUEUE_SIZE", "7").queue.max_spans, 7U);
  EXPECT_EQ(ReadWith("OTEL_BSP_MAX_EXPORT_BATCH_SIZE", "3").batch_spans, 3U);
  EXPECT_EQ(ReadWith("LIQUIDBLEND_TRACE_SPANS_PER_SECOND", "2.5").queue.max_per_second, 2.5);
  EXPECT_EQ(ReadWith("LIQUIDBLEND_TRACE_SPANS_PER_SECOND", "0").queue.max_per_second, 0);
  EXPECT_EQ(ReadWith("OTEL_BSP_MAX_QUEUE_SIZE", "").queue.max_spans, 2048U);
  for (const auto& [name, value] : {std::pair("OTEL_EXPORTER_OTLP_TIMEOUT", "0"),
                                    {"OTEL_EXPORTER_OTLP_TIMEOUT", "10s"},
                                    {"OTEL_BSP_SCHEDULE_DELAY", "-1"},
                                    {"OTEL_BSP_MAX_QUEUE_SIZE", "0"},
                                    {"OTEL_BSP_MAX_QUEUE_SIZE", "99999999999999999999"},
                                    {"LIQUIDBLEND_TRACE_SPANS_PER_SECOND", "-1"},
                                    {"LIQUIDBLEND_TRACE_SPANS_PER_SECOND", "nan"}}) {
    EXPECT_THAT(WarningFor(name, value), HasSubstr(absl::StrCat("is '", value, "'")));
  }
}

TEST_F(OptionsTest, SamplersHaveTheirStandardNames) {
  struct Known {
    const char* name;
    double ratio;
    bool by_parent;
  };
  Set("OTEL_TRACES_SAMPLER_ARG", "0.25");
  for (const Known& known : {Known{"always_on", 1, false},
                             {"always_off", 0, false},
                             {"traceidratio", 0.25, false},
                             {"parentbased_always_on", 1, true},
                             {"parentbased_always_off", 0, true},
                             {"parentbased_traceidratio", 0.25, true}}) {
    const Sampler sampler = ReadWith("OTEL_TRACES_SAMPLER", known.name).sampler;
    EXPECT_EQ(sampler.ratio, known.ratio) << known.name;
    EXPECT_EQ(sampler.by_parent, known.by_parent) << known.name;
  }
  EXPECT_TRUE(ReadWith("OTEL_TRACES_SAMPLER", "").sampler.by_parent);
  EXPECT_THAT(WarningFor("OTEL_TRACES_SAMPLER", "xray"), HasSubstr("'xray'"));
  Set("OTEL_TRACES_SAMPLER_ARG", "2");
  EXPECT_THAT(WarningFor("OTEL_TRACES_SAMPLER", "traceidratio"), HasSubstr("'2'"));
}

TEST_F(OptionsTest, AnotherProtocolIsWarnedOf) {
  EXPECT_THAT(WarningFor("OTEL_EXPORTER_OTLP_PROTOCOL", "grpc"), HasSubstr("http/json"));
  ReadWith("OTEL_EXPORTER_OTLP_PROTOCOL", "http/protobuf");
}

TEST_F(OptionsTest, TheResourceIsTheProgramUnlessToldOtherwise) {
  const Resource own = ReadWith("A", "").resource;
  EXPECT_EQ(own.version, "1.2.3");
  EXPECT_THAT(own.attributes, Contains(Pair("service.name", AttributeValue("liquidblend-test"))));
  EXPECT_THAT(own.attributes, Contains(Pair("service.version", AttributeValue("1.2.3"))));
  EXPECT_THAT(own.attributes, Contains(Pair("process.pid", AttributeValue(int64_t{getpid()}))));
  Set("OTEL_RESOURCE_ATTRIBUTES", "service.name=a,deployment.environment=test%20farm");
  const Resource given = ReadWith("A", "").resource;
  EXPECT_THAT(given.attributes, Contains(Pair("service.name", AttributeValue("a"))));
  EXPECT_THAT(given.attributes,
              Contains(Pair("deployment.environment", AttributeValue("test farm"))));
  const Resource named = ReadWith("OTEL_SERVICE_NAME", "b").resource;
  EXPECT_THAT(named.attributes, Contains(Pair("service.name", AttributeValue("b"))));
}

}  // namespace
}  // namespace liquidblend::trace
