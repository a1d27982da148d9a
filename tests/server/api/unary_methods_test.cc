#include "server/api/unary_methods.h"

#include <google/protobuf/descriptor.h>
#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

#include "google/longrunning/operations.pb.h"
#include "liquidblend/v1/liquidblend.pb.h"

namespace liquidblend::server {
namespace {

using google::protobuf::DescriptorPool;
using google::protobuf::MethodDescriptor;

std::vector<const MethodDescriptor*> MethodsOfTheApi() {
  std::vector<const MethodDescriptor*> methods;
  for (const char* name : {"liquidblend.v1.LiquidBlend", "google.longrunning.Operations"}) {
    const auto* service = DescriptorPool::generated_pool()->FindServiceByName(name);
    for (int k = 0; k < service->method_count(); ++k) methods.push_back(service->method(k));
  }
  return methods;
}

// Those that take several steps or wait have handlers of their own.
TEST(UnaryMethods, AreAllWithOneRequestAndOneResponseThatEndByThemselves) {
  const std::set<std::string> others = {"ImportAnimation", "GetFrame", "MeasureCorrespondences",
                                        "WaitOperation"};
  ASSERT_NE(DescriptorPool::generated_pool()->FindServiceByName("liquidblend.v1.LiquidBlend"),
            nullptr);
  for (const MethodDescriptor* method : MethodsOfTheApi()) {
    const bool is_unary = !method->client_streaming() && !method->server_streaming();
    const UnaryMethod* unary = FindUnaryMethod(method->name());
    ASSERT_EQ(unary != nullptr, is_unary && !others.contains(method->name())) << method->name();
    if (unary == nullptr) continue;
    EXPECT_EQ(unary->method->name, method->name());
    EXPECT_EQ(unary->new_request()->GetDescriptor(), method->input_type()) << method->name();
  }
}

TEST(Methods, AllHaveTheirLimits) {
  for (const MethodDescriptor* method : MethodsOfTheApi()) {
    const Method* found = FindMethod(method->name());
    ASSERT_NE(found, nullptr) << method->name();
    EXPECT_EQ(found->name, method->name());
    EXPECT_GT(found->max_request_bytes, 0);
  }
  EXPECT_EQ(FindMethod("GetFamil"), nullptr);
}

TEST(ResourceOf, IsWhatARequestNames) {
  v1::RegisterFamilyRequest registration;
  EXPECT_EQ(ResourceOf(registration), "");
  registration.set_family_id("splash");
  EXPECT_EQ(ResourceOf(registration), "families/splash");
  v1::GetAnimationRequest animation;
  animation.set_name(
      "animations/\x01"
      "drop");
  EXPECT_EQ(ResourceOf(animation), "animations/?drop");
}

}  // namespace
}  // namespace liquidblend::server
