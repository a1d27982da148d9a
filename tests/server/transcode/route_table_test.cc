#include "server/transcode/route_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "google/longrunning/operations.pb.h"
#include "liquidblend/v1/liquidblend.pb.h"

namespace liquidblend::transcode {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

RouteTable Table() {
  std::vector<HttpRule> rules = RulesOf(*v1::Family::descriptor()->file()->service(0));
  for (const HttpRule& rule :
       RulesOf(*google::longrunning::Operation::descriptor()->file()->service(0))) {
    rules.push_back(rule);
  }
  return RouteTable(rules);
}

std::string Found(std::string_view method, std::string_view path) {
  const RouteTable table = Table();  // has what the match refers to
  const RouteMatch match = table.Find(method, path);
  return match.rule == nullptr ? "" : match.rule->method->name() + " " + match.variable;
}

TEST(RouteTable, FindsTheRuleOfMethodAndPath) {
  EXPECT_EQ(Found("GET", "/v1/animations"), "ListAnimations ");
  EXPECT_EQ(Found("GET", "/v1/animations/drop"), "GetAnimation animations/drop");
  EXPECT_EQ(Found("DELETE", "/v1/animations/drop"), "DeleteAnimation animations/drop");
  EXPECT_EQ(Found("POST", "/v1/animations:import"), "ImportAnimation ");
  EXPECT_EQ(Found("POST", "/v1/families/f:rollback"), "RollbackFamily families/f");
  EXPECT_EQ(Found("GET", "/v1/families/f:presignDownload"), "PresignDownload families/f");
  EXPECT_EQ(Found("GET", "/v1/animations/drop:read"), "ReadFile animations/drop");
  EXPECT_EQ(Found("GET", "/v1/operations"), "ListOperations operations");
  EXPECT_EQ(Found("GET", "/v1/operations/7"), "GetOperation operations/7");
  EXPECT_EQ(Found("GET", "/v1/operations/7/8"), "GetOperation operations/7/8");
  EXPECT_EQ(Found("POST", "/v1/operations/7:cancel"), "CancelOperation operations/7");
  EXPECT_EQ(Found("GET", "/v1/operations/7:watch"), "WatchOperation operations/7");
}

TEST(RouteTable, FindsNothingElse) {
  for (const char* path :
       {"", "/", "v1/animations", "/v1", "/v1/", "/v1/animations/", "/v1//drop",
        "/v1/animations/a/b", "/v1/animations:", "/v1/animations:impor", "/v1/families/f:import",
        "/v1/families/:rollback", "/v2/families", "/v1/Families", "/v1/operations/", ":",
        "/:", "/v1/families/f:rollback/"}) {
    EXPECT_EQ(Found("GET", path) + Found("POST", path), "") << path;
    EXPECT_THAT(Table().MethodsOf(path), IsEmpty()) << path;
  }
  EXPECT_EQ(Found("PUT", "/v1/families/f"), "");
  EXPECT_THAT(Table().MethodsOf("/v1/families/f"), ElementsAre("GET", "DELETE"));
  EXPECT_THAT(Table().MethodsOf("/v1/families"), ElementsAre("POST", "GET"));
}

TEST(RouteTable, DecodesNamesButNoStructure) {
  EXPECT_EQ(Found("GET", "/v1/families/a%2Fb"), "GetFamily families/a/b");
  EXPECT_EQ(Found("GET", "/v1/families/a%3Awatch"), "GetFamily families/a:watch");
  EXPECT_EQ(Found("GET", "/v1/families/%zz"), "GetFamily families/%zz");
  EXPECT_EQ(Found("GET", "/v1/f%61milies"), "");
}

}  // namespace
}  // namespace liquidblend::transcode
