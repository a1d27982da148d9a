#include "server/grpc/server.h"

#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <atomic>
#include <thread>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "google/rpc/status.pb.h"
#include "server/grpc/grpc_status.h"
#include "tests/server/grpc/server_testing.h"

namespace liquidblend::server {
namespace {

using testing::HasSubstr;

constexpr std::chrono::seconds kLongest(60);  // that is waited for what must happen

TEST_F(ServerTest, HealthIsServingForTheServerAndItsServices) {
  EXPECT_EQ(Health(""), 1);
  EXPECT_EQ(Health("liquidblend.v1.LiquidBlend"), 1);
  EXPECT_EQ(Health("google.longrunning.Operations"), 1);
}

TEST_F(ServerTest, IsHealthyOnceTheFamiliesThatAreAskedForAreThere) {
  PublishSplash();
  ASSERT_TRUE(catalog_->RecordFamilyUses({{"splash", 1}}).ok());
  ServerOptions options;
  options.preload_time = absl::Hours(1);
  Start(options);
  while (Health("") != 1) std::this_thread::yield();
  EXPECT_NE(families_.Peek("splash", 1), nullptr);
  EXPECT_EQ(Health("liquidblend.v1.LiquidBlend"), 1);
}

TEST_F(ServerTest, RecordsWhatFramesWereAskedFor) {
  PublishSplash();
  grpc::ClientContext context;
  v1::GetFrameRequest request;
  request.set_family("families/splash");
  request.add_weights(1.0);
  v1::Frame frame;
  ASSERT_THAT(stub_->GetFrame(&context, request, &frame), IsOk());
  server_->Drain(absl::Seconds(10));
  const auto used = catalog_->ListMostUsedFamilies(10);
  ASSERT_TRUE(used.ok()) << used.status();
  ASSERT_EQ(used->size(), 1);
  EXPECT_EQ((*used)[0].id, "splash");
}

// So that clients see new servers; a stream is not cut for that.
TEST_F(ServerTest, EndsConnectionsOfSomeAgeButNotTheirStreams) {
  PublishSplash();
  ServerOptions options;
  options.connection_age = absl::Seconds(1);
  Start(options);
  grpc::ClientContext context;
  auto stream = stub_->StreamFrames(&context);
  v1::StreamFramesRequest request = Lossless();
  request.set_lossless(false);
  request.set_loop(true);
  ASSERT_TRUE(stream->Write(request));
  v1::StreamFramesResponse response;
  ASSERT_TRUE(stream->Read(&response));  // then it was ready
  EXPECT_TRUE(channel_->WaitForStateChange(GRPC_CHANNEL_READY,
                                           std::chrono::system_clock::now() + kLongest));
  for (int k = 0; k < 10; ++k) ASSERT_TRUE(stream->Read(&response)) << k;
  context.TryCancel();
  stream->Finish();
}

TEST_F(ServerTest, RefusesAgesOfConnectionsThatMakeNoSense) {
  ServerOptions options;
  for (const absl::Duration age : {absl::Milliseconds(1), -absl::Seconds(1), absl::Hours(1000)}) {
    options.connection_age = age;
    EXPECT_THAT(options.Validate().ToString(), HasSubstr("connection_age"));
  }
  options.connection_age = absl::ZeroDuration();
  EXPECT_TRUE(options.Validate().ok());
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
  request.set_family("animations/splash");
  v1::Frame frame;
  const grpc::Status status = stub_->GetFrame(&context, request, &frame);
  EXPECT_THAT(status,
              EndsWith(grpc::StatusCode::INVALID_ARGUMENT, "must be families/NAME or NAME"));
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

TEST_F(ServerTest, CallsAreCountedWithTheirCodes) {
  PublishSplash();
  for (const double weight : {0.5, 99.0}) {
    grpc::ClientContext context;
    v1::GetFrameRequest request;
    request.set_family("families/splash");
    request.add_weights(weight);
    v1::Frame frame;
    stub_->GetFrame(&context, request, &frame);
  }
  grpc::ClientContext context;
  auto stream = stub_->StreamFrames(&context);
  stream->Write(Lossless());
  v1::StreamFramesResponse response;
  while (stream->Read(&response)) {
  }
  EXPECT_THAT(stream->Finish(), IsOk());
  server_->Drain(absl::Seconds(10));
  const std::string text = server_->api().metrics().Text({});
  for (const char* line :
       {"requests_total{code=\"OK\",method=\"GetFrame\",protocol=\"grpc\"} 1\n",
        "requests_total{code=\"INVALID_ARGUMENT\",method=\"GetFrame\",protocol=\"grpc\"} 1\n",
        "requests_total{code=\"OK\",method=\"StreamFrames\",protocol=\"grpc\"} 1\n",
        "liquidblend_frames_total{family=\"splash\",preset=\"fastest\"} 8\n",
        "liquidblend_frame_stage_seconds_count{stage=\"queue\"} 8\n",
        "liquidblend_frame_stage_seconds_count{stage=\"encode\"} 8\n",
        "liquidblend_frame_stage_seconds_count{stage=\"write\"} 9\n"}) {
    EXPECT_THAT(text, HasSubstr(line));
  }
}

TEST_F(ServerTest, AFrameAskedForAgainIsTheSameBytesByAnyWay) {
  PublishSplash();
  std::vector<std::string> all;
  for (int k = 0; k < 3; ++k) {
    grpc::ClientContext context;
    v1::GetFrameRequest request;
    request.set_family("families/splash");
    request.add_weights(0.5);
    v1::Frame frame;
    ASSERT_THAT(stub_->GetFrame(&context, request, &frame), IsOk());
    all.push_back(frame.SerializeAsString());
  }
  grpc::ClientContext context;
  auto stream = stub_->StreamFrames(&context);
  ASSERT_TRUE(stream->Write(Lossless()));
  v1::StreamFramesResponse response;
  ASSERT_TRUE(stream->Read(&response));  // of time 0, too
  all.push_back(response.frame().SerializeAsString());
  for (const std::string& bytes : all) EXPECT_EQ(bytes, all[0]);
  context.TryCancel();
  stream->Finish();
}

TEST_F(ServerTest, BytesThatAreNoRequestAreRefused) {
  const auto [status, reply] = CallRaw("/liquidblend.v1.LiquidBlend/GetFrame", "\x0a\xff\xff\xff");
  EXPECT_THAT(status,
              EndsWith(grpc::StatusCode::INVALID_ARGUMENT, "not parse as a message of the method"));
}

TEST_F(ServerTest, ACallThatIsLateIsEnded) {
  PublishSplash();
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() - std::chrono::seconds(1));
  v1::GetFrameRequest request;
  request.set_family("families/splash");
  request.add_weights(1.0);
  v1::Frame frame;
  EXPECT_THAT(stub_->GetFrame(&context, request, &frame),
              EndsWith(grpc::StatusCode::DEADLINE_EXCEEDED, ""));
}

// What clients see while new versions are published under them.
struct SwapWitness {
  int64_t num_frames = 0;
  std::atomic<int64_t> last_version = 0;  // read while the client goes on
  int64_t num_backward = 0;               // a version older than one seen before
  absl::Duration longest_gap;
  absl::Time last;

  void See(const v1::Frame& frame) {
    if (num_frames++ == 0) last = absl::Now();
    if (frame.version() < last_version) ++num_backward;
    last_version = std::max<int64_t>(last_version, frame.version());
    longest_gap = std::max(longest_gap, absl::Now() - last);
    last = absl::Now();
  }
};

TEST_F(ServerTest, VersionsAreSwappedUnderLoadWithoutAFailureOrALongWait) {
  constexpr int kNumVersions = 6;
  // A swap takes no more than the catalog's own work; generous for machines that are busy.
  constexpr absl::Duration kLongGap = absl::Seconds(2);
  PublishSplash();
  std::atomic<bool> is_over = false;
  std::vector<SwapWitness> callers(2);
  SwapWitness streamer;
  {
    std::vector<std::jthread> clients;
    for (SwapWitness& witness : callers) {
      clients.emplace_back([&] {
        for (int k = 0; !is_over; ++k) {
          grpc::ClientContext context;
          v1::GetFrameRequest request;
          request.set_family("families/splash");
          request.add_weights(0.01 * (k % 100));
          v1::Frame frame;
          ASSERT_THAT(stub_->GetFrame(&context, request, &frame), IsOk());
          witness.See(frame);
        }
      });
    }
    clients.emplace_back([&] {
      grpc::ClientContext context;
      auto stream = stub_->StreamFrames(&context);
      v1::StreamFramesRequest request = Lossless();
      request.set_lossless(false);
      request.set_loop(true);
      request.set_frames_per_second(100);
      ASSERT_TRUE(stream->Write(request));
      v1::StreamFramesResponse response;
      while (!is_over && stream->Read(&response)) {
        streamer.See(response.frame());
        if (response.frame_index() % 10 == 0) stream->Write(request);  // takes the newest version
      }
      EXPECT_TRUE(is_over);
      context.TryCancel();
      stream->Finish();
    });
    for (int version = 2; version <= kNumVersions; ++version) {
      PublishFamily("splash", "a", "b", version);
      grpc::ClientContext context;
      v1::GetFrameRequest request;
      request.set_family("families/splash");
      request.add_weights(0.5);
      request.set_version(version);  // waits until it is ready
      v1::Frame frame;
      EXPECT_THAT(stub_->GetFrame(&context, request, &frame), IsOk());
      EXPECT_EQ(frame.version(), version);
    }
    const auto has_newest = [&] {
      return streamer.last_version > 1 &&
             std::all_of(callers.begin(), callers.end(),
                         [](const SwapWitness& w) { return w.last_version == kNumVersions; });
    };
    const absl::Time give_up = absl::Now() + absl::Seconds(30);
    while (absl::Now() < give_up && !has_newest()) absl::SleepFor(absl::Milliseconds(10));
    is_over = true;
  }
  for (const SwapWitness& witness : callers) {
    EXPECT_EQ(witness.last_version, kNumVersions);
    EXPECT_EQ(witness.num_backward, 0);
    EXPECT_LT(witness.longest_gap, kLongGap);
  }
  EXPECT_GT(streamer.last_version, 1);
  EXPECT_LT(streamer.longest_gap, kLongGap);
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

// A watch of the server's health.
class HealthWatch {
 public:
  explicit HealthWatch(const std::shared_ptr<grpc::Channel>& channel) : stub_(channel) {
    call_ = stub_.PrepareCall(&context_, "/grpc.health.v1.Health/Watch", &queue_);
    call_->StartCall(this);
    EXPECT_TRUE(Wait());
    const grpc::Slice nothing("");
    call_->WriteLast(grpc::ByteBuffer(&nothing, 1), grpc::WriteOptions(), this);
    EXPECT_TRUE(Wait());
  }

  // Whether there was another message.
  bool Read() {
    grpc::ByteBuffer health;
    call_->Read(&health, this);
    return Wait();
  }

  void Cancel() { context_.TryCancel(); }

  grpc::Status Finish() {
    grpc::Status status;
    call_->Finish(&status, this);
    EXPECT_TRUE(Wait());
    return status;
  }

 private:
  bool Wait() {
    void* tag = nullptr;
    bool ok = false;
    return queue_.Next(&tag, &ok) && ok;
  }

  grpc::ClientContext context_;
  grpc::CompletionQueue queue_;
  grpc::GenericStub stub_;
  std::unique_ptr<grpc::GenericClientAsyncReaderWriter> call_;
};

TEST_F(ServerTest, AWatcherOfTheHealthDoesNotHoldUpTheShutdown) {
  HealthWatch watch(channel_);
  ASSERT_TRUE(watch.Read());
  const absl::Time begin = absl::Now();
  server_->Drain(absl::Seconds(60));
  EXPECT_LT(absl::Now() - begin, absl::Seconds(20));
  EXPECT_TRUE(watch.Read()) << "not serving";
  EXPECT_FALSE(watch.Read());
  EXPECT_FALSE(watch.Finish().ok());
}

TEST_F(ServerTest, AClientThatLeavesAWatchOfTheHealthIsNoError) {
  HealthWatch watch(channel_);
  ASSERT_TRUE(watch.Read());
  watch.Cancel();
  watch.Finish();
  std::string text;
  const auto has = [&](const char* code) {
    return absl::StrContains(text, absl::StrCat("code=\"", code, "\",method=\"Watch\""));
  };
  for (const absl::Time end = absl::Now() + absl::Seconds(20); absl::Now() < end;) {
    text = server_->api().metrics().Text({});
    if (has("CANCELLED") || has("UNKNOWN")) break;
    absl::SleepFor(absl::Milliseconds(1));
  }
  EXPECT_TRUE(has("CANCELLED")) << text;
  EXPECT_FALSE(has("UNKNOWN")) << text;
}

TEST_F(ServerTest, ASecondServerOnThePortIsRefused) {
  ServerOptions options;
  options.listen = server_->address();
  const auto second = Server::Start(*catalog_, *blobs_, families_, options);
  EXPECT_THAT(second.status(),
              store::Fails(absl::StatusCode::kFailedPrecondition, server_->address()));
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
  EXPECT_THAT(message([](auto& o) { o.frame_cache_bytes = -1; }), HasSubstr("frame_cache_bytes"));
  EXPECT_THAT(message([](auto& o) { o.queue.max_waiting_cost = 0; }),
              HasSubstr("max_waiting_cost"));
  EXPECT_THAT(message([](auto& o) { o.limits.max_stream_bytes = -1; }),
              HasSubstr("max_stream_bytes"));
  EXPECT_THAT(message([](auto& o) { o.max_message_bytes = 1; }), HasSubstr("max_message_bytes"));
  EXPECT_THAT(message([](auto& o) { o.listen = "nowhere"; }), HasSubstr("nowhere"));
  EXPECT_THAT(message([](auto& o) { o.limits.max_upload_files = 0; }),
              HasSubstr("max_upload_files"));
  EXPECT_THAT(message([](auto& o) { o.limits.watch_interval = absl::ZeroDuration(); }),
              HasSubstr("watch_interval"));
}

}  // namespace
}  // namespace liquidblend::server
