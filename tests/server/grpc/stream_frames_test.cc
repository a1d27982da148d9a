// StreamFrames over the wire.
#include <cmath>
#include <thread>

#include "absl/time/clock.h"
#include "google/rpc/error_details.pb.h"
#include "server/frames/frame_stream.h"
#include "tests/allocation_testing.h"
#include "tests/server/extremes.h"
#include "tests/server/grpc/raw_call.h"
#include "tests/server/grpc/server_testing.h"

namespace liquidblend::server {
namespace {

using testing::ElementsAre;

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

// A stream whose frames come until it is cancelled.
class EndlessStream {
 public:
  EndlessStream(v1::LiquidBlend::Stub& stub, const v1::StreamFramesRequest& first)
      : stream_(stub.StreamFrames(&context_)) {
    stream_->Write(first);
  }
  ~EndlessStream() {
    context_.TryCancel();
    stream_->Finish();
  }
  void Write(const v1::StreamFramesRequest& change) { stream_->Write(change); }
  int64_t ReadVersion() {
    v1::StreamFramesResponse response;
    return stream_->Read(&response) ? response.frame().version() : -1;
  }
  // Reads until there is a frame of that version, or the end.
  bool ReadUntil(int64_t version) {
    for (int64_t read = 0; read != -1;) {
      read = ReadVersion();
      if (read == version) return true;
    }
    return false;
  }
  grpc::Status Finish() { return stream_->Finish(); }

 private:
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::StreamFramesRequest, v1::StreamFramesResponse>>
      stream_;
};

TEST_F(ServerTest, AStreamShowsTheVersionThatIsAskedForByNumber) {
  keep_versions_ = 2;
  PublishSplash();
  PublishFamily("splash", "a", "b", 2);
  v1::StreamFramesRequest request = Lossless();
  request.set_lossless(false);
  request.set_loop(true);
  request.set_frames_per_second(200);
  request.set_version(1);
  request.set_min_version(2);  // of no account beside a version
  EndlessStream stream(*stub_, request);
  EXPECT_EQ(stream.ReadVersion(), 1);
  v1::StreamFramesRequest change;
  change.add_weights(0.25);
  stream.Write(change);
  EXPECT_EQ(stream.ReadVersion(), 1);
  v1::StreamFramesRequest newer;
  newer.set_version(2);
  stream.Write(newer);
  EXPECT_TRUE(stream.ReadUntil(2));
  v1::StreamFramesRequest older;
  older.set_version(1);
  stream.Write(older);
  EXPECT_TRUE(stream.ReadUntil(1));
  v1::StreamFramesRequest latest;
  latest.set_family("splash");
  stream.Write(latest);
  EXPECT_TRUE(stream.ReadUntil(2));
}

TEST_F(ServerTest, AStreamOfAVersionThatIsNotThereEnds) {
  PublishSplash();
  v1::StreamFramesRequest request = Lossless();
  for (const auto& [version, code] : {std::pair(7, grpc::StatusCode::NOT_FOUND),
                                      std::pair(-1, grpc::StatusCode::INVALID_ARGUMENT)}) {
    request.set_version(version);
    grpc::ClientContext context;
    auto stream = stub_->StreamFrames(&context);
    stream->Write(request);
    v1::StreamFramesResponse response;
    EXPECT_FALSE(stream->Read(&response));
    EXPECT_THAT(stream->Finish(), EndsWith(code, "version"));
  }
}

TEST(MergeRequest, OneKindOfVersionReplacesTheOther) {
  v1::StreamFramesRequest request, exact, oldest, family;
  exact.set_version(3);
  oldest.set_min_version(5);
  family.set_family("families/other");
  MergeRequest(exact, request);
  MergeRequest(oldest, request);
  EXPECT_EQ(request.version(), 0);
  EXPECT_EQ(request.min_version(), 5);
  MergeRequest(exact, request);
  EXPECT_EQ(request.version(), 3);
  EXPECT_EQ(request.min_version(), 0);
  MergeRequest(family, request);
  EXPECT_EQ(request.version(), 0);
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

TEST_F(ServerTest, BytesThatAreNoMessageAreNotTheEndOfAStreamsRequests) {
  PublishSplash();
  v1::StreamFramesRequest held = Lossless();
  held.set_lossless(false);
  held.set_rate(0);
  held.set_frames_per_second(0.001);  // one frame
  const std::string request = held.SerializeAsString();
  for (const std::vector<std::string>& messages :
       {std::vector<std::string>{"\xFF\xFF\xFF"}, {request, "\xFF\xFF\xFF"}}) {
    const grpc::Status status =
        CallInBytes(channel_, "/liquidblend.v1.LiquidBlend/StreamFrames", messages);
    EXPECT_THAT(status, EndsWith(grpc::StatusCode::INVALID_ARGUMENT,
                                 "not parse as a message of the method"));
    const auto info = DetailOf<google::rpc::ErrorInfo>(status);
    EXPECT_EQ(info.reason(), "REQUEST_MALFORMED");
    EXPECT_EQ(info.metadata().at("method"), "StreamFrames");
  }
}

// Fields that no version of the API has are appended by protobuf, message after message: they
// filled the memory of a server in seconds.
TEST_F(ServerTest, UnknownFieldsOfAStreamAreNotKept) {
  if (!allocation::kAllocationsMayFail) GTEST_SKIP() << "sanitizers keep what was freed";
  constexpr int kNumMessages = 1000;
  PublishSplash();
  v1::StreamFramesRequest held = Lossless();
  held.set_lossless(false);
  held.set_rate(0);
  held.set_frames_per_second(0.001);
  v1::StreamFramesRequest unknown;
  unknown.GetReflection()->MutableUnknownFields(&unknown)->AddLengthDelimited(
      15000, std::string(60'000, 'x'));
  grpc::ClientContext context;
  const auto stream = stub_->StreamFrames(&context);
  ASSERT_TRUE(stream->Write(held));
  v1::StreamFramesResponse response;
  ASSERT_TRUE(stream->Read(&response));
  const int64_t before = ResidentBytes();
  for (int k = 0; k < kNumMessages; ++k) ASSERT_TRUE(stream->Write(unknown));
  held.set_frames_per_second(100);  // the stream has read them all when this has its effect
  ASSERT_TRUE(stream->Write(held));
  for (int k = 0; k < 3; ++k) ASSERT_TRUE(stream->Read(&response));
  EXPECT_LT(ResidentBytes() - before, kNumMessages * 60'000 / 2);
  context.TryCancel();
}

TEST_F(ServerTest, RequestsForFramesAreSmall) {
  PublishSplash();
  v1::GetFrameRequest request;
  request.set_family("families/splash");
  for (int k = 0; k < 40'000; ++k) request.add_parameters();
  for (const char* method : {"GetFrame", "StreamFrames"}) {
    const grpc::Status status =
        CallInBytes(channel_, absl::StrCat("/liquidblend.v1.LiquidBlend/", method),
                    {request.SerializeAsString()});
    EXPECT_THAT(status, EndsWith(grpc::StatusCode::INVALID_ARGUMENT, "more than the 65536"));
    const auto info = DetailOf<google::rpc::ErrorInfo>(status);
    EXPECT_EQ(info.reason(), "REQUEST_TOO_LARGE");
    EXPECT_EQ(info.metadata().at("method"), method);
  }
}

// gRPC keeps them for as long as the call lasts.
TEST_F(ServerTest, RequestsOfCallsThatWaitAreSmall) {
  for (const char* method : {"liquidblend.v1.LiquidBlend/WatchOperation",
                             "google.longrunning.Operations/WaitOperation"}) {
    v1::WatchOperationRequest request;  // field 1 of both is the name
    request.set_name("operations/" + std::string(70'000, 'x'));
    const grpc::Status status =
        CallInBytes(channel_, absl::StrCat("/", method), {request.SerializeAsString()});
    EXPECT_THAT(status, EndsWith(grpc::StatusCode::INVALID_ARGUMENT, "more than the 65536"));
  }
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

}  // namespace
}  // namespace liquidblend::server
