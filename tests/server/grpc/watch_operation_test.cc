// WatchOperation and WaitOperation over the wire.
#include <chrono>

#include "tests/server/grpc/server_testing.h"

namespace liquidblend::server {
namespace {

TEST_F(ServerTest, WatchShowsEachChangeAndEndsWhenDone) {
  const store::pb::JobRecord job = SubmitImport("drop");
  grpc::ClientContext context;
  v1::WatchOperationRequest request;
  request.set_name("operations/" + job.id());
  auto reader = stub_->WatchOperation(&context, request);
  Operation operation;
  v1::ImportAnimationMetadata metadata;
  ASSERT_TRUE(reader->Read(&operation));
  ASSERT_TRUE(operation.metadata().UnpackTo(&metadata));
  EXPECT_EQ(metadata.progress().stage(), "queued");
  const store::Lease lease = TakeJob();
  ASSERT_TRUE(reader->Read(&operation));  // running
  EXPECT_FALSE(operation.done());
  ASSERT_TRUE(catalog_->FailJob(lease.lease_id, absl::DataLossError("torn"), false).ok());
  ASSERT_TRUE(reader->Read(&operation));
  EXPECT_TRUE(operation.done());
  EXPECT_EQ(operation.error().message(), "torn");
  EXPECT_FALSE(reader->Read(&operation));
  EXPECT_THAT(reader->Finish(), IsOk());
}

// A client that finds out by pings whether the server is there, several times while nothing
// happens.
TEST_F(ServerTest, WatchAllowsPingsOfItsClientWhileNothingHappens) {
  const store::pb::JobRecord job = SubmitImport("drop");
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, 1200);
  arguments.SetInt(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  const auto stub = v1::LiquidBlend::NewStub(
      grpc::CreateCustomChannel(server_->address(), grpc::InsecureChannelCredentials(), arguments));
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(7));
  v1::WatchOperationRequest request;
  request.set_name("operations/" + job.id());
  auto reader = stub->WatchOperation(&context, request);
  Operation operation;
  ASSERT_TRUE(reader->Read(&operation));
  EXPECT_FALSE(reader->Read(&operation));
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
}

TEST_F(ServerTest, WatchOfNothingIsNotFound) {
  grpc::ClientContext context;
  v1::WatchOperationRequest request;
  request.set_name("operations/none");
  auto reader = stub_->WatchOperation(&context, request);
  Operation operation;
  EXPECT_FALSE(reader->Read(&operation));
  EXPECT_THAT(reader->Finish(), EndsWith(grpc::StatusCode::NOT_FOUND, "none"));
}

TEST_F(ServerTest, WaitAnswersAfterItsTimeoutOrWhenTheJobIsDone) {
  const store::pb::JobRecord job = SubmitImport("drop");
  google::longrunning::WaitOperationRequest request;
  request.set_name("operations/" + job.id());
  request.mutable_timeout()->set_nanos(20'000'000);
  Operation operation;
  {
    grpc::ClientContext context;
    ASSERT_THAT(operations_->WaitOperation(&context, request, &operation), IsOk());
    EXPECT_FALSE(operation.done());
  }
  ASSERT_TRUE(catalog_->RequestCancel(job.id()).ok());
  grpc::ClientContext context;
  request.clear_timeout();
  ASSERT_THAT(operations_->WaitOperation(&context, request, &operation), IsOk());
  EXPECT_TRUE(operation.done());
  EXPECT_EQ(operation.error().code(), grpc::StatusCode::CANCELLED);
}

}  // namespace
}  // namespace liquidblend::server
