#include "server/rpc/server.h"

#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

#include <thread>

#include "google/longrunning/operations.grpc.pb.h"
#include "google/rpc/status.pb.h"
#include "liquidblend/v1/liquidblend.grpc.pb.h"
#include "server/rpc/grpc_status.h"
#include "tests/server/rpc/rpc_testing.h"

namespace liquidblend::rpc {
namespace {

using google::longrunning::Operation;
using google::longrunning::Operations;
using testing::ElementsAre;
using testing::HasSubstr;

MATCHER_P2(EndsWith, code, words, "") {
  *result_listener << arg.error_code() << ": " << arg.error_message();
  return arg.error_code() == code && absl::StrContains(arg.error_message(), words);
}

MATCHER(IsOk, "") {
  *result_listener << arg.error_code() << ": " << arg.error_message();
  return arg.ok();
}

class ServerTest : public RpcTest {
 protected:
  void SetUp() override { Start(ServerOptions()); }

  void Start(ServerOptions options) {
    options.listen = "127.0.0.1:0";
    options.limits = SmallLimits();
    auto server = Server::Start(*catalog_, *blobs_, families_, options);
    ASSERT_TRUE(server.ok()) << server.status();
    server_ = *std::move(server);
    channel_ = grpc::CreateChannel(server_->address(), grpc::InsecureChannelCredentials());
    stub_ = v1::LiquidBlend::NewStub(channel_);
    operations_ = Operations::NewStub(channel_);
  }

  // Calls a method of a service whose messages we do not have, in bytes.
  std::pair<grpc::Status, std::string> CallRaw(const std::string& method,
                                               const std::string& request) {
    grpc::ClientContext context;
    grpc::CompletionQueue queue;
    grpc::Slice slice(request);
    grpc::ByteBuffer buffer(&slice, 1);
    grpc::GenericStub stub(channel_);
    auto call = stub.PrepareUnaryCall(&context, method, buffer, &queue);
    call->StartCall();
    grpc::ByteBuffer reply;
    grpc::Status status;
    call->Finish(&reply, &status, this);
    void* tag = nullptr;
    bool ok = false;
    queue.Next(&tag, &ok);
    std::string bytes;
    grpc::Slice whole;
    if (reply.Valid() && reply.DumpToSingleSlice(&whole).ok()) {
      bytes.assign(reinterpret_cast<const char*>(whole.begin()), whole.size());
    }
    return {status, bytes};
  }

  // 1: serving, 2: not serving (grpc.health.v1).
  int Health(const std::string& service) {
    std::string request;
    if (!service.empty()) {
      request = absl::StrCat("\n", std::string(1, static_cast<char>(service.size())), service);
    }
    const auto [status, reply] = CallRaw("/grpc.health.v1.Health/Check", request);
    EXPECT_THAT(status, IsOk());
    return reply.size() == 2 ? reply[1] : 0;
  }

  std::unique_ptr<Server> server_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<v1::LiquidBlend::Stub> stub_;
  std::unique_ptr<Operations::Stub> operations_;
};

v1::StreamFramesRequest Lossless() {
  v1::StreamFramesRequest request;
  request.set_family("families/splash");
  request.add_weights(0.5);
  request.set_lossless(true);
  return request;
}

TEST_F(ServerTest, HealthIsServingForTheServerAndItsServices) {
  EXPECT_EQ(Health(""), 1);
  EXPECT_EQ(Health("liquidblend.v1.LiquidBlend"), 1);
  EXPECT_EQ(Health("google.longrunning.Operations"), 1);
}

TEST_F(ServerTest, ReflectionListsTheServices) {
  const auto [status, reply] =
      CallRaw("/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo", "\x3a\x01*");
  EXPECT_THAT(status, IsOk());
  EXPECT_THAT(reply, HasSubstr("liquidblend.v1.LiquidBlend"));
  EXPECT_THAT(reply, HasSubstr("google.longrunning.Operations"));
}

TEST_F(ServerTest, ErrorsCarryFieldsAndAReason) {
  grpc::ClientContext context;
  v1::GetFrameRequest request;
  request.set_family("splash");
  v1::Frame frame;
  const grpc::Status status = stub_->GetFrame(&context, request, &frame);
  EXPECT_THAT(status, EndsWith(grpc::StatusCode::INVALID_ARGUMENT, "families/{id}"));
  google::rpc::Status details;
  ASSERT_TRUE(details.ParseFromString(status.error_details()));
  ASSERT_EQ(details.details_size(), 2);
  google::rpc::BadRequest bad;
  ASSERT_TRUE(details.details(0).UnpackTo(&bad));
  EXPECT_EQ(bad.field_violations(0).field(), "family");
  google::rpc::ErrorInfo info;
  ASSERT_TRUE(details.details(1).UnpackTo(&info));
  EXPECT_EQ(info.reason(), "INVALID_ARGUMENT");
  EXPECT_EQ(info.domain(), "liquidblend");
}

TEST(GrpcStatus, AReasonOfOnesOwnIsKept) {
  const grpc::Status status =
      ToGrpcStatus(WithReason(absl::ResourceExhaustedError("full"), "TOO_MANY_FILES"));
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  google::rpc::Status details;
  ASSERT_TRUE(details.ParseFromString(status.error_details()));
  google::rpc::ErrorInfo info;
  ASSERT_TRUE(details.details(0).UnpackTo(&info));
  EXPECT_EQ(info.reason(), "TOO_MANY_FILES");
}

TEST_F(ServerTest, GetFrameGivesADracoMesh) {
  PublishSplash();
  grpc::ClientContext context;
  v1::GetFrameRequest request;
  request.set_family("families/splash");
  request.add_weights(1.0);
  v1::Frame frame;
  ASSERT_THAT(stub_->GetFrame(&context, request, &frame), IsOk());
  EXPECT_EQ(frame.data().substr(0, 5), "DRACO");
}

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

TEST_F(ServerTest, ALosslessStreamGivesAllFramesAndEnds) {
  PublishSplash();
  grpc::ClientContext context;
  auto stream = stub_->StreamFrames(&context);
  ASSERT_TRUE(stream->Write(Lossless()));
  stream->WritesDone();
  v1::StreamFramesResponse response;
  int num_frames = 0;
  while (stream->Read(&response)) {
    EXPECT_EQ(response.frame_index(), num_frames++);
    EXPECT_EQ(response.num_dropped(), 0);
  }
  EXPECT_THAT(stream->Finish(), IsOk());
  EXPECT_EQ(num_frames, kFamilyFrames);
}

TEST_F(ServerTest, APacedStreamNeverRunsAheadOfTheClock) {
  PublishSplash();
  grpc::ClientContext context;
  auto stream = stub_->StreamFrames(&context);
  v1::StreamFramesRequest request = Lossless();
  request.set_lossless(false);
  request.set_frames_per_second(100);
  const absl::Time begin = absl::Now();
  ASSERT_TRUE(stream->Write(request));
  stream->WritesDone();
  v1::StreamFramesResponse response;
  int64_t num_frames = 0;
  while (stream->Read(&response)) ++num_frames;
  EXPECT_THAT(stream->Finish(), IsOk());
  // 7 frames' time of the family at 24 frames per second, in steps of 10 ms; the last is not late.
  const double expected_s = std::floor((kFamilyFrames - 1) / 24.0 * 100) / 100;
  EXPECT_GE(absl::ToDoubleSeconds(absl::Now() - begin), expected_s - 0.01);
  EXPECT_EQ(num_frames + response.num_dropped(), std::lround(expected_s * 100) + 1);
}

TEST_F(ServerTest, NewWeightsCountFromTheNextFrameOn) {
  PublishSplash();
  grpc::ClientContext context;
  auto stream = stub_->StreamFrames(&context);
  v1::StreamFramesRequest request = Lossless();
  request.set_lossless(false);
  request.set_loop(true);
  request.set_frames_per_second(200);
  ASSERT_TRUE(stream->Write(request));
  v1::StreamFramesResponse response;
  ASSERT_TRUE(stream->Read(&response));
  EXPECT_THAT(response.frame().weights(), ElementsAre(0.5));
  v1::StreamFramesRequest change;
  change.add_weights(1.25);
  ASSERT_TRUE(stream->Write(change));
  int num_old = 0;
  while (stream->Read(&response) && response.frame().weights(0) == 0.5) ++num_old;
  EXPECT_THAT(response.frame().weights(), ElementsAre(1.25));
  EXPECT_LT(num_old, 100);
  context.TryCancel();
  EXPECT_THAT(stream->Finish(), EndsWith(grpc::StatusCode::CANCELLED, ""));
}

TEST_F(ServerTest, AMistakeInAStreamEndsItByName) {
  PublishSplash();
  grpc::ClientContext context;
  auto stream = stub_->StreamFrames(&context);
  v1::StreamFramesRequest request = Lossless();
  request.set_lossless(false);
  request.set_rate(0);
  ASSERT_TRUE(stream->Write(request));
  v1::StreamFramesResponse response;
  ASSERT_TRUE(stream->Read(&response));
  v1::StreamFramesRequest change;
  change.set_family("families/none");
  stream->Write(change);
  while (stream->Read(&response)) {
  }
  EXPECT_THAT(stream->Finish(), EndsWith(grpc::StatusCode::NOT_FOUND, "none"));
}

TEST_F(ServerTest, AStreamWithoutARequestIsRefused) {
  grpc::ClientContext context;
  auto stream = stub_->StreamFrames(&context);
  stream->WritesDone();
  v1::StreamFramesResponse response;
  EXPECT_FALSE(stream->Read(&response));
  EXPECT_THAT(stream->Finish(), EndsWith(grpc::StatusCode::INVALID_ARGUMENT, "family"));
}

TEST_F(ServerTest, ManyStreamsAtOnceAreAllWhole) {
  PublishSplash();
  std::vector<std::string> all(8);
  {
    std::vector<std::jthread> clients;
    for (std::string& bytes : all) {
      clients.emplace_back([&] {
        grpc::ClientContext context;
        auto stream = stub_->StreamFrames(&context);
        stream->Write(Lossless());
        stream->WritesDone();
        v1::StreamFramesResponse response;
        while (stream->Read(&response)) bytes += response.frame().data();
        EXPECT_THAT(stream->Finish(), IsOk());
      });
    }
  }
  for (const std::string& bytes : all) EXPECT_EQ(bytes, all[0]);
  EXPECT_FALSE(all[0].empty());
}

TEST_F(ServerTest, DrainEndsStreamsWithUnavailable) {
  PublishSplash();
  const store::pb::JobRecord job = SubmitImport("drop");
  grpc::ClientContext stream_context;
  auto stream = stub_->StreamFrames(&stream_context);
  v1::StreamFramesRequest request = Lossless();
  request.set_lossless(false);
  request.set_rate(0);
  request.set_frames_per_second(0.001);  // the next frame is due in 1,000 s
  ASSERT_TRUE(stream->Write(request));
  v1::StreamFramesResponse response;
  ASSERT_TRUE(stream->Read(&response));

  grpc::ClientContext watch_context;
  v1::WatchOperationRequest watch_request;
  watch_request.set_name("operations/" + job.id());
  auto watch = stub_->WatchOperation(&watch_context, watch_request);
  Operation operation;
  ASSERT_TRUE(watch->Read(&operation));

  grpc::ClientContext upload_context;
  Operation uploaded;
  auto upload = stub_->UploadAnimation(&upload_context, &uploaded);
  v1::UploadAnimationRequest header;
  header.mutable_header()->set_animation_id("other");
  ASSERT_TRUE(upload->Write(header));
  v1::UploadAnimationRequest file;
  file.mutable_file()->set_name("f1.ply");
  file.mutable_file()->set_size_bytes(1);
  ASSERT_TRUE(upload->Write(file));
  while (store::CountFiles(folder_.path() + "/tmp") == 0) std::this_thread::yield();

  std::jthread drain([&] { server_->Drain(absl::Seconds(30)); });
  EXPECT_FALSE(stream->Read(&response));
  EXPECT_THAT(stream->Finish(), EndsWith(grpc::StatusCode::UNAVAILABLE, "shutting down"));
  while (watch->Read(&operation)) {
  }
  EXPECT_THAT(watch->Finish(), EndsWith(grpc::StatusCode::UNAVAILABLE, "shutting down"));
  EXPECT_THAT(upload->Finish(), EndsWith(grpc::StatusCode::UNAVAILABLE, "shutting down"));
}

TEST_F(ServerTest, ASecondServerOnThePortIsRefused) {
  ServerOptions options;
  options.listen = server_->address();
  const auto second = Server::Start(*catalog_, *blobs_, families_, options);
  EXPECT_THAT(second.status(), store::Fails(absl::StatusCode::kUnavailable, server_->address()));
}

TEST(ServerOptions, NamesTheFirstFieldOutOfRange) {
  const auto message = [](auto change) {
    ServerOptions options;
    change(options);
    return std::string(options.Validate().message());
  };
  EXPECT_TRUE(ServerOptions().Validate().ok());
  EXPECT_THAT(message([](auto& o) { o.num_io_threads = 0; }), HasSubstr("num_io_threads"));
  EXPECT_THAT(message([](auto& o) { o.num_frame_threads = -1; }), HasSubstr("num_frame_threads"));
  EXPECT_THAT(message([](auto& o) { o.max_waiting_calls = 0; }), HasSubstr("max_waiting_calls"));
  EXPECT_THAT(message([](auto& o) { o.max_message_bytes = 1; }), HasSubstr("max_message_bytes"));
  EXPECT_THAT(message([](auto& o) { o.listen = "nowhere"; }), HasSubstr("nowhere"));
  EXPECT_THAT(message([](auto& o) { o.limits.max_upload_files = 0; }),
              HasSubstr("max_upload_files"));
  EXPECT_THAT(message([](auto& o) { o.limits.watch_interval = absl::ZeroDuration(); }),
              HasSubstr("watch_interval"));
}

}  // namespace
}  // namespace liquidblend::rpc
