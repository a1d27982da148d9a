// Wherever in a call memory runs out, the call ends with an error and the server goes on.
#include "absl/strings/str_cat.h"
#include "tests/allocation_testing.h"
#include "tests/failing_new.h"
#include "tests/server/grpc/raw_call.h"
#include "tests/server/grpc/server_testing.h"

namespace liquidblend::server {
namespace {

using testing_memory::FailingNew;

// Messages of parameters without a name take three bytes each on the wire, and a pointer in memory:
// so only copies of the message are as large as this, and nothing of gRPC's own.
constexpr int kNumParameters = 20'000;
constexpr int kNumTimes = 12'000;  // 96,000 bytes on the wire, and while they are parsed twice that
constexpr int kNumTargets = 20'000;
constexpr size_t kLarge = 100'000;  // bytes
constexpr int kMaxFailures = 60;    // more large allocations than a call makes

class OutOfMemoryTest : public ServerTest {
 protected:
  void SetUp() override {
    ServerTest::SetUp();
    PublishSplash();
    // From here on the family is in memory.
    ASSERT_THAT(Call("GetFrame", Request(0)), IsOk());
  }

  // The only message of a call.
  static std::vector<std::string> Request(int num_parameters) {
    v1::StreamFramesRequest request;
    request.set_family("families/splash");
    if (num_parameters == 0) request.add_weights(0.5);
    for (int k = 0; k < num_parameters; ++k) request.add_parameters();
    return {request.SerializeAsString()};
  }

  // A header with so many times, which is more than an upload may have files.
  static std::vector<std::string> Upload(int num_times) {
    v1::UploadAnimationRequest message;
    message.mutable_header()->set_animation_id("drop");
    for (int k = 0; k < num_times; ++k) {
      message.mutable_header()->mutable_options()->add_frame_times(k);
    }
    return {message.SerializeAsString()};
  }

  // An import from the server's own files, likewise.
  static std::vector<std::string> Import(int num_times) {
    v1::ImportAnimationRequest message;
    message.set_animation_id("drop");
    for (int k = 0; k < num_times; ++k) message.mutable_options()->add_frame_times(k);
    return {message.SerializeAsString()};
  }

  // Targets without a name take two bytes each on the wire.
  static std::vector<std::string> Registration(int num_targets) {
    v1::RegisterFamilyRequest message;
    message.set_family_id("drops");
    for (int k = 0; k < num_targets; ++k) message.add_targets();
    return {message.SerializeAsString()};
  }

  grpc::Status Call(const std::string& method, const std::vector<std::string>& messages) {
    return CallInBytes(channel_, absl::StrCat("/liquidblend.v1.LiquidBlend/", method), messages);
  }
};

TEST_F(OutOfMemoryTest, EndsTheCallAndNotTheServer) {
  LB_SKIP_UNLESS_ALLOCATIONS_MAY_FAIL();
  struct Case {
    const char* method;
    std::vector<std::string> messages;  // copied before memory fails
    grpc::StatusCode otherwise;
    int min_failures;
  };
  const Case cases[] = {
      // The family has no parameters.
      {"GetFrame", Request(kNumParameters), grpc::StatusCode::FAILED_PRECONDITION, 3},
      {"StreamFrames", Request(kNumParameters), grpc::StatusCode::FAILED_PRECONDITION, 3},
      {"UploadAnimation", Upload(kNumTimes), grpc::StatusCode::INVALID_ARGUMENT, 1},
      {"ImportAnimation", Import(kNumTimes), grpc::StatusCode::INVALID_ARGUMENT, 1},
      {"RegisterFamily", Registration(kNumTargets), grpc::StatusCode::INVALID_ARGUMENT, 1}};
  for (const Case& call : cases) {
    int num_failures = 0;
    bool has_failed = true;
    for (int n = 0; has_failed && n < kMaxFailures; ++n) {
      {
        const FailingNew failing(kLarge, n);
        const grpc::Status status = Call(call.method, call.messages);
        has_failed = FailingNew::has_failed();
        EXPECT_EQ(status.error_code(),
                  has_failed ? grpc::StatusCode::RESOURCE_EXHAUSTED : call.otherwise)
            << call.method << " " << n << ": " << status.error_message();
      }
      if (has_failed) ++num_failures;
      EXPECT_THAT(Call("GetFrame", Request(0)), IsOk()) << call.method << " " << n;
    }
    EXPECT_FALSE(has_failed) << call.method << ": not every place was tried";
    EXPECT_GE(num_failures, call.min_failures) << call.method;
  }
}

}  // namespace
}  // namespace liquidblend::server
