#include "server/http/exchange/route.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

namespace liquidblend::http {
namespace {

using testing::ElementsAre;

TEST(Routes, EveryMethodOfTheApiHasOne) {
  const Routes routes;
  std::set<std::string> found;
  for (const transcode::HttpRule& rule : routes.table().rules()) {
    std::string path;
    for (const std::string& segment : rule.segments) {
      path += "/" + (segment[0] == '*' ? "some" : segment);
    }
    if (!rule.verb.empty()) path += ":" + rule.verb;
    const Route route = routes.Find(rule.http_method, path);
    ASSERT_EQ(route.resource, Resource::kMethod) << path;
    ASSERT_NE(route.method, nullptr) << path;
    EXPECT_EQ(route.method->name, rule.method->name());
    EXPECT_EQ(route.pattern, rule.pattern);
    EXPECT_TRUE(route.Allows(rule.http_method));
    found.insert(route.method->name);
  }
  for (const auto* service : server::ApiServices()) {
    for (int k = 0; k < service->method_count(); ++k) {
      const std::string& name = service->method(k)->name();
      EXPECT_EQ(found.contains(name), name != "StreamFrames") << name;
    }
  }
}

TEST(Routes, AFamilysFramesAreFiles) {
  const Route route = Routes().Find("GET", "/v1/families/a%62/frame.ply");
  EXPECT_EQ(route.resource, Resource::kFrame);
  EXPECT_EQ(route.family, "ab");
  EXPECT_EQ(route.format, v1::Encoding::PLY);
  EXPECT_EQ(route.pattern, "/v1/families/{family}/frame.ply");
  EXPECT_THAT(route.allowed, ElementsAre("GET", "HEAD"));
}

TEST(Routes, AHeadTakesTheWayOfItsGet) {
  const Route route = Routes().Find("HEAD", "/v1/families/f");
  ASSERT_NE(route.method, nullptr);
  EXPECT_STREQ(route.method->name, "GetFamily");
  EXPECT_TRUE(route.Allows("HEAD"));
  EXPECT_FALSE(Routes().Find("HEAD", "/v1/families/f:rollback").Allows("HEAD"));
}

}  // namespace
}  // namespace liquidblend::http
