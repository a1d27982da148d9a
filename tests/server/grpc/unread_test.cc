// Clients that ask for frames, or other answers, and never read them.
#include <algorithm>
#include <chrono>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "tests/server/grpc/http2_client.h"
#include "tests/server/grpc/server_testing.h"

namespace liquidblend::server::unread_test {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kPatience(20'000);
constexpr int kNumCalls = 40;
constexpr int kNumWithRoom = 10;  // unread frames of one account

// A server with memory for kNumWithRoom unread frames, and two principals.
class UnreadTest : public ServerTest {
 protected:
  void SetUp() override { StartWith(absl::Hours(1)); }

  void StartWith(absl::Duration patience) {
    const NewToken greedy = *MakeToken("studio:greedy", {"frames"});
    const NewToken honest = *MakeToken("studio:honest", {"frames"});
    greedy_ = "Bearer " + greedy.token;
    honest_ = "Bearer " + honest.token;
    const std::string path = folder_.path() + "/tokens.json";
    std::ofstream(path) << R"({"principals": [)" << greedy.entry << ", " << honest.entry << "]}";
    PublishSplash();
    ServerOptions options;
    options.authorizer = *Authorizer::Open(path);
    Start(options);
    options.unread = {.max_bytes = kNumWithRoom * SizeOfFrame(), .patience = patience};
    Start(options);
  }

  // All different, of nearly the same size.
  static v1::GetFrameRequest RequestOf(int k) {
    v1::GetFrameRequest request;
    request.set_family("families/splash");
    request.add_weights(0.5 + 0.001 * k);
    request.mutable_encoding()->set_format(v1::Encoding::PLY);
    return request;
  }

  grpc::Status GetFrame(int k, v1::Frame& frame) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + kPatience);
    context.AddMetadata("authorization", honest_);
    return stub_->GetFrame(&context, RequestOf(k), &frame);
  }

  int64_t SizeOfFrame() {
    v1::Frame frame;
    EXPECT_THAT(GetFrame(0, frame), IsOk());
    return static_cast<int64_t>(frame.ByteSizeLong());
  }

  // Asks for kNumCalls frames, and reads none. Returns how many calls are refused.
  int AskAndReadNothing(Http2Client& peer) {
    return AskAndReadNothing(peer, "GetFrame",
                             [](int k) { return RequestOf(k).SerializeAsString(); });
  }

  int AskAndReadNothing(Http2Client& peer, const std::string& method,
                        const std::function<std::string(int k)>& request_of) {
    for (int k = 0; k < kNumCalls; ++k) {
      const std::string request = request_of(k);
      streams_.push_back(peer.Open(absl::StrCat("/liquidblend.v1.LiquidBlend/", method),
                                   {{"authorization", greedy_}}));
      peer.Send(streams_.back(), MessagePrefix(static_cast<uint32_t>(request.size())) + request,
                kPatience);
      peer.HalfClose(streams_.back());
    }
    const auto give_up = std::chrono::steady_clock::now() + kPatience;
    while (NumEnded(peer) < kNumCalls / 2 && std::chrono::steady_clock::now() < give_up) {
      peer.Receive(milliseconds(10));
    }
    return NumEnded(peer);
  }

  int NumEnded(const Http2Client& peer) const {
    return static_cast<int>(std::count_if(streams_.begin(), streams_.end(),
                                          [&](int s) { return peer.is_answered(s); }));
  }

  std::string greedy_, honest_;
  std::vector<int> streams_;
};

TEST_F(UnreadTest, TakeBoundedMemoryAndNotThatOfOthers) {
  Http2Client peer(server_->port(), Reads::kNothing);
  EXPECT_GE(AskAndReadNothing(peer), kNumCalls / 2);
  v1::Frame frame;
  EXPECT_THAT(GetFrame(kNumCalls, frame), IsOk());
}

TEST_F(UnreadTest, AnswersThatAreNoFramesCountAsWell) {
  v1::ReadFileRequest request;
  request.set_name("families/splash");
  Http2Client peer(server_->port(), Reads::kNothing);
  EXPECT_GE(AskAndReadNothing(peer, "ReadFile", [&](int) { return request.SerializeAsString(); }),
            kNumCalls / 2);
  v1::Frame frame;
  EXPECT_THAT(GetFrame(kNumCalls, frame), IsOk());
}

class BriefPatienceTest : public UnreadTest {
 protected:
  static constexpr absl::Duration kUnreadPatience = absl::Seconds(1);
  void SetUp() override { StartWith(kUnreadPatience); }
};

// Half of the memory may stay taken. All frames that the peer asks for are made before the honest
// client asks: one that is made later could end the honest client's call.
TEST_F(BriefPatienceTest, EndsReadersOnceOthersNeedTheMemory) {
  Http2Client peer(server_->port(), Reads::kNothing);
  AskAndReadNothing(peer);
  absl::SleepFor(2 * kUnreadPatience);
  const auto give_up = std::chrono::steady_clock::now() + kPatience;
  v1::Frame frame;
  do {
    ASSERT_THAT(GetFrame(kNumCalls, frame), IsOk());
    peer.Receive(milliseconds(10));
  } while (NumEnded(peer) < kNumCalls - kNumWithRoom / 2 &&
           std::chrono::steady_clock::now() < give_up);
  EXPECT_GE(NumEnded(peer), kNumCalls - kNumWithRoom / 2);
}

// Its client has read all that was sent, and sets no other weights for a while. The server may hear
// of the reading a moment after the client.
TEST_F(BriefPatienceTest, LeavesAStreamThatPausesAlone) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + 3 * kPatience);
  context.AddMetadata("authorization", honest_);
  const auto stream = stub_->StreamFrames(&context);
  v1::StreamFramesRequest request = Lossless();
  request.mutable_encoding()->set_format(v1::Encoding::PLY);
  request.set_credit(1);
  ASSERT_TRUE(stream->Write(request));
  v1::StreamFramesResponse response;
  ASSERT_TRUE(stream->Read(&response));
  absl::SleepFor(2 * kUnreadPatience);
  Http2Client peer(server_->port(), Reads::kNothing);
  AskAndReadNothing(peer);
  absl::SleepFor(2 * kUnreadPatience);
  v1::Frame frame;
  EXPECT_THAT(GetFrame(kNumCalls, frame), IsOk());
  ASSERT_TRUE(stream->Write(request));
  EXPECT_TRUE(stream->Read(&response));
}

}  // namespace
}  // namespace liquidblend::server::unread_test
