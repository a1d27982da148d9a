#include "server/transcode/http_rule.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "google/longrunning/operations.pb.h"
#include "liquidblend/v1/liquidblend.pb.h"

namespace liquidblend::transcode {
namespace {

using google::protobuf::ServiceDescriptor;
using testing::ElementsAre;

const ServiceDescriptor& Api() { return *v1::Family::descriptor()->file()->service(0); }
const ServiceDescriptor& Operations() {
  return *google::longrunning::Operation::descriptor()->file()->service(0);
}

TEST(MakeRule, TakesATemplateApart) {
  const auto& method = *Api().FindMethodByName("RollbackFamily");
  const HttpRule rule = MakeRule(method, "POST", "/v1/{name=families/*}:rollback", "*");
  EXPECT_THAT(rule.segments, ElementsAre("v1", "families", "*"));
  EXPECT_EQ(rule.variable, "name");
  EXPECT_EQ(rule.variable_begin, 1U);
  EXPECT_EQ(rule.variable_end, 3U);
  EXPECT_EQ(rule.verb, "rollback");
  EXPECT_EQ(rule.body, "*");
  EXPECT_EQ(rule.pattern, "/v1/families/{family}:rollback");
}

TEST(MakeRule, TakesLiteralsAndRests) {
  const auto& method = *Operations().FindMethodByName("GetOperation");
  const HttpRule plain = MakeRule(method, "GET", "/v1/animations:import", "");
  EXPECT_THAT(plain.segments, ElementsAre("v1", "animations"));
  EXPECT_EQ(plain.variable, "");
  EXPECT_EQ(plain.verb, "import");
  const HttpRule rest = MakeRule(method, "GET", "/v1/{name=operations/**}", "");
  EXPECT_THAT(rest.segments, ElementsAre("v1", "operations", "**"));
  EXPECT_EQ(rest.pattern, "/v1/operations/{operation}");
  const HttpRule whole = MakeRule(method, "GET", "/v1/{name=operations}", "");
  EXPECT_EQ(whole.variable, "name");
  EXPECT_EQ(whole.pattern, "/v1/operations");
}

// What MakeRule() takes; and a body is whole, or there is none.
TEST(RulesOf, AreOfTheSubsetInTheWholeApi) {
  for (const ServiceDescriptor* service : {&Api(), &Operations()}) {
    std::set<std::string> methods;
    for (const HttpRule& rule : RulesOf(*service)) {
      methods.insert(rule.method->name());
      EXPECT_EQ(rule.segments[0], "v1") << rule.method->name();
      EXPECT_TRUE(rule.body.empty() || rule.body == "*") << rule.method->name();
      EXPECT_TRUE(rule.http_method == "GET" || rule.http_method == "POST" ||
                  rule.http_method == "DELETE")
          << rule.method->name();
      EXPECT_EQ(rule.pattern.find_first_of("=*"), std::string::npos) << rule.pattern;
      if (rule.variable.empty()) continue;
      const auto* field = rule.method->input_type()->FindFieldByName(rule.variable);
      ASSERT_NE(field, nullptr) << rule.method->name();
      EXPECT_EQ(field->cpp_type(), google::protobuf::FieldDescriptor::CPPTYPE_STRING);
    }
    // By WebSocket, and by a rule of the server's own.
    methods.insert(service == &Api() ? "StreamFrames" : "WaitOperation");
    EXPECT_EQ(static_cast<int>(methods.size()), service->method_count()) << service->name();
  }
}

}  // namespace
}  // namespace liquidblend::transcode
