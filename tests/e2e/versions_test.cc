// Clients that have heard of a version of a family get no older one.
#include "tests/e2e/e2e_testing.h"

namespace liquidblend::e2e {
namespace {

constexpr int kNumRounds = 5;

class VersionsTest : public E2eTest {
 protected:
  VersionsTest() : server_(StartServer(1)) {
    ExpectSuccess(AwaitDone(ImportBall("a", 1.0).name()));
    ExpectSuccess(AwaitDone(ImportBall("b", 2.0).name()));
  }

  // Returns the name of the operation.
  std::string StartRegistration() {
    Operation registration;
    const grpc::Status status = Register(1, registration);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return registration.name();
  }

  // The version that the operation says that it has published.
  static int64_t VersionOf(const Operation& operation) {
    ExpectSuccess(operation);
    v1::RegisterFamilyMetadata metadata;
    EXPECT_TRUE(operation.metadata().UnpackTo(&metadata));
    return metadata.version();
  }
  int64_t Publish() { return VersionOf(AwaitDone(StartRegistration())); }

  grpc::Status GetFrame(int64_t min_version, v1::Frame& frame) {
    grpc::ClientContext context;
    v1::GetFrameRequest request;
    request.set_family("families/balls");
    request.add_weights(0.5);
    request.set_min_version(min_version);
    return stub_->GetFrame(&context, request, &frame);
  }

  int64_t ServedVersion() {
    v1::Frame frame;
    const grpc::Status status = GetFrame(0, frame);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return frame.version();
  }

  Process server_;
};

TEST_F(VersionsTest, AFrameAfterAWatchedRegistrationIsOfItsVersion) {
  for (int round = 1; round <= kNumRounds; ++round) {
    const int64_t published = Publish();
    EXPECT_EQ(published, round);
    EXPECT_EQ(ServedVersion(), published);
  }
}

TEST_F(VersionsTest, AFrameAfterAnOperationThatWasLookedAtIsOfItsVersion) {
  Publish();
  for (int round = 2; round <= kNumRounds; ++round) {
    EXPECT_EQ(ServedVersion(), round - 1);  // that one is in memory
    const std::string name = StartRegistration();
    Operation operation;
    Await([&] {
      grpc::ClientContext context;
      google::longrunning::GetOperationRequest request;
      request.set_name(name);
      EXPECT_TRUE(operations_->GetOperation(&context, request, &operation).ok());
      return operation.done();
    });
    EXPECT_EQ(ServedVersion(), VersionOf(operation));
  }
}

// A request as older clients make it, too: it has no field `replace`.
TEST_F(VersionsTest, ANameThatIsTakenIsRefusedAndARepeatedRequestIsNot) {
  v1::RegisterFamilyRequest request;
  request.set_family_id("balls");
  request.set_source("animations/a");
  request.add_targets("animations/b");
  request.set_request_id("first");
  request.mutable_options()->set_max_iterations(1);
  const auto submit = [&](Operation& operation) {
    grpc::ClientContext context;
    return stub_->RegisterFamily(&context, request, &operation);
  };
  Operation first, repeated, second;
  ASSERT_TRUE(submit(first).ok());
  ExpectSuccess(AwaitDone(first.name()));
  ASSERT_TRUE(submit(repeated).ok());
  EXPECT_EQ(repeated.name(), first.name());
  request.set_request_id("second");
  const grpc::Status refused = submit(second);
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::ALREADY_EXISTS);
  EXPECT_THAT(refused.error_message(),
              ::testing::HasSubstr("family 'balls' exists already, in version 1; register under "
                                   "another name, or set replace"));
  EXPECT_EQ(ServedVersion(), 1);
  request.set_replace(true);
  ASSERT_TRUE(submit(second).ok());
  ExpectSuccess(AwaitDone(second.name()));
  EXPECT_EQ(ServedVersion(), 2);
}

TEST_F(VersionsTest, AVersionThatIsNotPublishedIsNotWaitedFor) {
  Publish();
  v1::Frame frame;
  EXPECT_TRUE(GetFrame(1, frame).ok());
  const grpc::Status status = GetFrame(2, frame);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_THAT(status.error_message(),
              ::testing::HasSubstr("has no version 2 yet; the published one is 1"));
}

TEST_F(VersionsTest, AnOpenStreamGoesOnAndTakesTheVersionThatItIsAskedFor) {
  Publish();
  grpc::ClientContext context;
  const auto stream = stub_->StreamFrames(&context);
  v1::StreamFramesRequest request;
  request.set_family("families/balls");
  request.add_weights(0.5);
  request.set_loop(true);
  ASSERT_TRUE(stream->Write(request));
  v1::StreamFramesResponse response;
  ASSERT_TRUE(stream->Read(&response));
  EXPECT_EQ(response.frame().version(), 1);
  const int64_t published = Publish();
  v1::StreamFramesRequest change;
  change.set_min_version(published);
  ASSERT_TRUE(stream->Write(change));
  Await([&] {
    EXPECT_TRUE(stream->Read(&response));
    return response.frame().version() == published;
  });
  context.TryCancel();
  stream->Finish();
}

}  // namespace
}  // namespace liquidblend::e2e
