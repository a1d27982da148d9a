// Whatever bytes come in the place of requests, the server answers and goes on.
#include <algorithm>
#include <iterator>
#include <map>
#include <random>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "core/base/log.h"
#include "google/rpc/error_details.pb.h"
#include "server/access/call_log.h"
#include "tests/server/grpc/raw_call.h"
#include "tests/server/grpc/seeds.h"
#include "tests/server/grpc/server_testing.h"

namespace liquidblend::server {
namespace {

constexpr int kNumTries = 60;  // per method

class MalformedTest : public ServerTest {
 protected:
  void SetUp() override {
    ServerTest::SetUp();
    PublishSplash();
  }

  // Flips, inserts, removes, doubles or replaces some of the bytes.
  std::string Spoil(std::string bytes) {
    const auto below = [this](size_t n) { return n == 0 ? 0 : random_() % n; };
    for (size_t k = 0; k < 1 + below(4); ++k) {
      const size_t at = below(bytes.size());
      switch (random_() % 5) {
        case 0:
          if (!bytes.empty()) bytes[at] = static_cast<char>(bytes[at] ^ (1 << below(8)));
          break;
        case 1:
          bytes.insert(at, 1 + below(12), static_cast<char>(random_()));
          break;
        case 2:
          bytes.erase(at, 1 + below(6));
          break;
        case 3:
          bytes += bytes.substr(at);
          break;
        default:
          bytes.insert(at, std::string(1 + below(9), '\xFF'));
      }
    }
    return bytes;
  }

  std::mt19937 random_{7};
};

TEST_F(MalformedTest, BytesThatAreNoMessageAreTheClientsMistake) {
  int num_methods = 0;
  for (const MethodDescriptor* method : AllMethods()) {
    if (method->client_streaming()) continue;
    const grpc::Status status = CallInBytes(channel_, PathOf(*method), {"\xFF\xFF\xFF"});
    EXPECT_THAT(status, EndsWith(grpc::StatusCode::INVALID_ARGUMENT,
                                 "not parse as a message of the method"));
    const auto info = DetailOf<google::rpc::ErrorInfo>(status);
    EXPECT_EQ(info.reason(), "REQUEST_MALFORMED");
    EXPECT_EQ(info.metadata().at("method"), method->name());
    ++num_methods;
  }
  EXPECT_GT(num_methods, 10);
}

TEST_F(MalformedTest, ABrokenMessageIsNotTheEndOfAnUpload) {
  const auto& method = *AllMethods()[0];
  ASSERT_EQ(method.name(), "UploadAnimation");
  std::vector<std::string> messages = SeedsOf(method);
  messages.push_back("\xFF\xFF\xFF");
  const grpc::Status status = CallInBytes(channel_, PathOf(method), messages);
  EXPECT_THAT(status,
              EndsWith(grpc::StatusCode::INVALID_ARGUMENT, "not parse as a message of the method"));
  EXPECT_EQ(catalog_->GetAnimation("drop").status().code(), absl::StatusCode::kNotFound);
  messages.pop_back();
  EXPECT_THAT(CallInBytes(channel_, PathOf(method), messages), IsOk());
}

TEST_F(MalformedTest, AMethodThatDoesNotExistIsToldOf) {
  const grpc::Status status = CallInBytes(channel_, "/liquidblend.v1.LiquidBlend/Nothing", {""});
  EXPECT_THAT(status, EndsWith(grpc::StatusCode::UNIMPLEMENTED, "LiquidBlend/Nothing"));
  EXPECT_EQ(DetailOf<google::rpc::ErrorInfo>(status).reason(), "METHOD_UNKNOWN");
}

TEST_F(MalformedTest, GarbageDoesNotFloodTheLog) {
  constexpr int kNumCalls = 300;
  constexpr int kNumClients = 2;  // that of a method that exists has a name
  base::StartLog("server", base::LogLevel::kInfo, base::LogFormat::kText);
  testing::internal::CaptureStderr();
  const absl::Time begin = absl::Now();
  for (int i = 0; i < kNumCalls; ++i) {
    const auto other = grpc::CreateChannel(server_->address(), grpc::InsecureChannelCredentials());
    const char* const paths[] = {"/liquidblend.v1.LiquidBlend/GetFrame", "/a/b",
                                 "/liquidblend.v1.LiquidBlend/GetFamily"};
    CallInBytes(i % 50 == 0 ? other : channel_, paths[i % 3], {"\xFF\xFF"});
  }
  const auto num_seconds = static_cast<int>(absl::ToDoubleSeconds(absl::Now() - begin)) + 1;
  server_->Drain(absl::ZeroDuration());  // tells of what is left
  const std::string log = testing::internal::GetCapturedStderr();
  const auto num_lines = std::count(log.begin(), log.end(), '\n');
  EXPECT_GE(num_lines, CallLog::kMaxLines);
  EXPECT_LE(num_lines, kNumClients * (CallLog::kMaxLines + 1) * num_seconds) << log;
  EXPECT_THAT(log, testing::HasSubstr(" more like this"));
}

TEST_F(MalformedTest, NoiseInEveryMethodHarmsNothingAndEveryErrorSaysWhy) {
  int num_errors = 0;
  for (const MethodDescriptor* method : AllMethods()) {
    if (absl::StartsWith(method->name(), "Delete")) continue;  // the family is needed below
    const std::vector<std::string> seeds = SeedsOf(*method);
    for (int k = 0; k < kNumTries; ++k) {
      SCOPED_TRACE(absl::StrCat(method->name(), " ", k));
      std::vector<std::string> messages = seeds;
      std::string& spoilt = messages[random_() % messages.size()];
      spoilt = Spoil(spoilt);
      const grpc::Status status = CallInBytes(channel_, PathOf(*method), messages);
      if (status.ok() || status.error_code() == grpc::StatusCode::CANCELLED) continue;
      ++num_errors;
      EXPECT_EQ(DetailOf<google::rpc::ErrorInfo>(status).domain(), "liquidblend")
          << status.error_code() << ": " << status.error_message();
      EXPECT_NE(status.error_code(), grpc::StatusCode::INTERNAL) << status.error_message();
      EXPECT_NE(status.error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
    }
  }
  EXPECT_GT(num_errors, 300);
  EXPECT_EQ(Health(""), 1);
  const std::string frame = FromText(*v1::GetFrameRequest::descriptor()
                                          ->file()
                                          ->FindServiceByName("LiquidBlend")
                                          ->FindMethodByName("GetFrame"),
                                     R"(family: "families/splash" weights: 0.5)");
  EXPECT_THAT(CallInBytes(channel_, "/liquidblend.v1.LiquidBlend/GetFrame", {frame}), IsOk());
}

}  // namespace
}  // namespace liquidblend::server
