// UploadAnimation over the wire.
#include "tests/server/grpc/server_testing.h"

namespace liquidblend::server {
namespace {

using testing::HasSubstr;

TEST_F(ServerTest, UploadedFilesBecomeAnOperation) {
  grpc::ClientContext context;
  Operation operation;
  auto writer = stub_->UploadAnimation(&context, &operation);
  v1::UploadAnimationRequest message;
  message.mutable_header()->set_animation_id("drop");
  ASSERT_TRUE(writer->Write(message));
  message.mutable_file()->set_name("f1.ply");
  message.mutable_file()->set_size_bytes(3);
  ASSERT_TRUE(writer->Write(message));
  message.set_chunk("abc");
  ASSERT_TRUE(writer->Write(message));
  writer->WritesDone();
  ASSERT_THAT(writer->Finish(), IsOk());
  EXPECT_THAT(operation.name(), HasSubstr("operations/"));
  EXPECT_EQ(TakeJob().job.import_animation().files(0).name(), "f1.ply");
}

TEST_F(ServerTest, ABadMessageEndsTheUploadAtOnce) {
  grpc::ClientContext context;
  Operation operation;
  auto writer = stub_->UploadAnimation(&context, &operation);
  v1::UploadAnimationRequest message;
  message.mutable_header()->set_animation_id("NO");
  writer->Write(message);
  EXPECT_THAT(writer->Finish(),
              EndsWith(grpc::StatusCode::INVALID_ARGUMENT, "header.animation_id"));
}

// A parsed message may take 30 times its size, and the next one may never come.
TEST_F(ServerTest, OnlyChunksOfAnUploadAreLarge) {
  grpc::ClientContext context;
  Operation operation;
  auto writer = stub_->UploadAnimation(&context, &operation);
  v1::UploadAnimationRequest message;
  message.mutable_header()->set_animation_id("drop");
  message.GetReflection()->MutableUnknownFields(&message)->AddLengthDelimited(
      1000, std::string(300'000, 'x'));
  writer->Write(message);
  EXPECT_THAT(writer->Finish(),
              EndsWith(grpc::StatusCode::INVALID_ARGUMENT, "more than the 262144"));
}

TEST_F(ServerTest, AClientThatGoesAwayLeavesNothingVisible) {
  {
    grpc::ClientContext context;
    Operation operation;
    auto writer = stub_->UploadAnimation(&context, &operation);
    v1::UploadAnimationRequest message;
    message.mutable_header()->set_animation_id("drop");
    ASSERT_TRUE(writer->Write(message));
    message.mutable_file()->set_name("f1.ply");
    message.mutable_file()->set_size_bytes(0);
    ASSERT_TRUE(writer->Write(message));  // what has arrived would do for an import
    context.TryCancel();
    EXPECT_THAT(writer->Finish(), EndsWith(grpc::StatusCode::CANCELLED, ""));
  }
  server_->Drain(absl::Seconds(10));  // all calls have ended
  EXPECT_TRUE(catalog_->ListAnimations(10, "")->records.empty());
  EXPECT_TRUE(catalog_->ListJobs(10, "")->records.empty());
}

}  // namespace
}  // namespace liquidblend::server
