// What a peer can take from the server before anybody knows who it is.
#include <zlib.h>

#include <chrono>
#include <fstream>
#include <functional>
#include <memory>
#include <vector>

#include "absl/strings/str_cat.h"
#include "tests/server/extremes.h"
#include "tests/server/grpc/http2_client.h"
#include "tests/server/grpc/server_testing.h"

namespace liquidblend::server::peers_test {
namespace {

using std::chrono::milliseconds;

constexpr int64_t kMiB = int64_t{1} << 20;
constexpr milliseconds kPatience(20'000);

// A server where nothing is allowed without a token.
class PeersTest : public ServerTest {
 protected:
  void SetUp() override { StartWith(32 * kMiB); }

  void StartWith(int64_t max_buffer_bytes) {
    const NewToken made = *MakeToken("honest", {"frames"});
    token_ = made.token;
    const std::string path = folder_.path() + "/tokens.json";
    std::ofstream(path) << R"({"principals": [)" << made.entry << "]}";
    ServerOptions options;
    options.authorizer = *Authorizer::Open(path);
    options.max_buffer_bytes = max_buffer_bytes;
    Start(options);
    PublishSplash();
  }

  static std::string PathOf(const std::string& method) {
    return "/liquidblend.v1.LiquidBlend/" + method;
  }

  // Whether a client with a token gets a frame. It calls again as liquidblend::Client does: gRPC
  // closes idle connections when its memory for buffers runs out, maybe while a call begins.
  bool ServesFrames() {
    constexpr int kMaxCalls = 3;
    grpc::Status status;
    for (int k = 0; k < kMaxCalls; ++k) {
      status = GetSplash();
      if (status.error_code() != grpc::StatusCode::UNAVAILABLE) break;
    }
    EXPECT_THAT(status, IsOk());
    return status.ok();
  }

  grpc::Status GetSplash() {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + kPatience);
    context.AddMetadata("authorization", "Bearer " + token_);
    v1::GetFrameRequest request;
    request.set_family("families/splash");
    request.add_weights(0.5);
    v1::Frame frame;
    return stub_->GetFrame(&context, request, &frame);
  }

  struct Unfinished {
    int64_t num_bytes = 0;   // that were sent
    int64_t peak_bytes = 0;  // of the process, above what it had before
  };

  // Begins 40 messages of 4 MiB on each of so many connections, and ends none.
  Unfinished SendUnfinished(int num_connections) {
    constexpr int kNumStreams = 40;
    const auto size_bytes = static_cast<uint32_t>(4 * kMiB - 1);
    const std::string message = MessagePrefix(size_bytes) + std::string(size_bytes - 1, 'x');
    ResetPeakMemory();
    const int64_t before = PeakBytes();
    std::vector<std::unique_ptr<Http2Client>> peers;
    Unfinished sent;
    for (int k = 0; k < num_connections; ++k) {
      Http2Client& peer = *peers.emplace_back(std::make_unique<Http2Client>(server_->port()));
      for (int i = 0; i < kNumStreams && peer.is_open(); ++i) {
        sent.num_bytes += static_cast<int64_t>(
            peer.Send(peer.Open(PathOf("GetFamily")), message, milliseconds(100)));
      }
      EXPECT_TRUE(ServesFrames());
    }
    sent.peak_bytes = PeakBytes() - before;
    return sent;
  }

  std::string token_;
};

// So many zeros, gzipped: a thousandth of their size.
std::string CompressedZeros(int64_t num_bytes) {
  z_stream stream = {};
  constexpr int kGzip = 15 + 16;
  EXPECT_EQ(deflateInit2(&stream, Z_BEST_COMPRESSION, Z_DEFLATED, kGzip, 9, Z_DEFAULT_STRATEGY),
            Z_OK);
  std::string zeros(kMiB, '\0');
  std::string out;
  for (int64_t done = 0; done < num_bytes; done += kMiB) {
    stream.next_in = reinterpret_cast<Bytef*>(zeros.data());
    stream.avail_in = static_cast<uInt>(zeros.size());
    do {
      char part[4096];
      stream.next_out = reinterpret_cast<Bytef*>(part);
      stream.avail_out = sizeof(part);
      deflate(&stream, done + kMiB < num_bytes ? Z_NO_FLUSH : Z_FINISH);
      out.append(part, sizeof(part) - stream.avail_out);
    } while (stream.avail_out == 0);
  }
  deflateEnd(&stream);
  return out;
}

TEST_F(PeersTest, ACompressedMessageIsNotDecompressed) {
  const std::string zeros = CompressedZeros(256 * kMiB);
  ASSERT_LT(zeros.size(), 400'000U) << "below the limit of messages";
  ASSERT_TRUE(ServesFrames());
  ResetPeakMemory();
  const int64_t before = PeakBytes();
  for (const char* method :
       {"GetFamily", "RegisterFamily", "GetFrame", "UploadAnimation", "StreamFrames"}) {
    for (const bool has_token : {false, true}) {
      Http2Client peer(server_->port());
      std::vector<Http2Client::Header> headers = {{"grpc-encoding", "gzip"}};
      if (has_token) headers.emplace_back("authorization", "Bearer " + token_);
      const int stream = peer.Open(PathOf(method), headers);
      peer.Send(stream, MessagePrefix(static_cast<uint32_t>(zeros.size()), true) + zeros,
                milliseconds(2000));
      peer.HalfClose(stream);
      EXPECT_TRUE(peer.AwaitEnd(stream, kPatience)) << method;
    }
  }
  EXPECT_LT(PeakBytes() - before, 64 * kMiB + kKeptBytes);
  EXPECT_TRUE(ServesFrames());
}

// Clients of other libraries that compress hear what the matter is.
TEST_F(PeersTest, AClientThatCompressesIsToldOfIt) {
  grpc::ClientContext context;
  context.set_compression_algorithm(GRPC_COMPRESS_GZIP);
  context.AddMetadata("authorization", "Bearer " + token_);
  v1::GetFamilyRequest request;
  request.set_name("families/" + std::string(1000, 'a'));
  v1::Family family;
  EXPECT_THAT(stub_->GetFamily(&context, request, &family),
              EndsWith(grpc::StatusCode::UNIMPLEMENTED, "ompression algorithm"));
}

TEST_F(PeersTest, RequestsThatNeverEndHaveBoundedMemory) {
  ASSERT_TRUE(ServesFrames());
  const Unfinished sent = SendUnfinished(3);
  EXPECT_GT(sent.num_bytes, 64 * kMiB) << "what was tried is more than what is allowed";
  EXPECT_LT(sent.peak_bytes, 160 * kMiB + kKeptBytes);
  EXPECT_TRUE(ServesFrames());
}

// docs/security.md has the peak.
class PeersAtTheDefaultLimitTest : public PeersTest {
 protected:
  void SetUp() override { StartWith(ServerOptions().max_buffer_bytes); }
};

TEST_F(PeersAtTheDefaultLimitTest, RequestsThatNeverEndHaveBoundedMemory) {
  ASSERT_TRUE(ServesFrames());
  const Unfinished sent = SendUnfinished(8);
  RecordProperty("sent_mib", static_cast<int>(sent.num_bytes / kMiB));
  RecordProperty("peak_mib", static_cast<int>(sent.peak_bytes / kMiB));
  EXPECT_GT(sent.num_bytes, 256 * kMiB) << "what was tried is more than what is allowed";
  EXPECT_LT(sent.peak_bytes, 3 * 128 * kMiB + kKeptBytes);
  EXPECT_TRUE(ServesFrames());
}

int64_t NumThreads() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (absl::StartsWith(line, "Threads:")) return std::stoll(line.substr(8));
  }
  return 0;
}

// gRPC's reflection takes a thread for as long as a stream lasts.
TEST_F(PeersTest, IdleStreamsOfReflectionAndHealthTakeFewThreads) {
  constexpr int kNumStreams = 200;
  ASSERT_TRUE(ServesFrames());
  const int64_t before = NumThreads();
  Http2Client peer(server_->port());
  std::vector<int> reflections;
  std::vector<int> watches;
  for (int k = 0; k < kNumStreams; ++k) {
    reflections.push_back(
        peer.Open("/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo"));
    watches.push_back(peer.Open("/grpc.health.v1.Health/Watch"));
    peer.Send(watches.back(), MessagePrefix(0), kPatience);
    peer.HalfClose(watches.back());
  }
  // Those that found no thread are refused: that is over when the last ones are.
  const auto give_up = std::chrono::steady_clock::now() + kPatience;
  const auto num_refused = [&] {
    return std::count_if(reflections.begin(), reflections.end(),
                         [&](int stream) { return peer.has_ended(stream); });
  };
  while (num_refused() < kNumStreams / 2 && std::chrono::steady_clock::now() < give_up) {
    peer.Receive(milliseconds(10));
  }
  EXPECT_GE(num_refused(), kNumStreams / 2);
  EXPECT_LT(NumThreads() - before, 20);
  EXPECT_EQ(Health(""), 1);
  EXPECT_TRUE(ServesFrames());
}

TEST_F(PeersTest, AConnectionHasABoundedNumberOfStreams) {
  constexpr int kLimit = 1000;
  Http2Client peer(server_->port());
  ASSERT_TRUE(peer.AwaitSettings(kPatience));
  int last = 0;
  for (int k = 0; k < kLimit + 100; ++k) last = peer.Open(PathOf("GetFamily"));
  // It would wait for its message, as the others do.
  EXPECT_TRUE(peer.AwaitEnd(last, kPatience));
  EXPECT_TRUE(ServesFrames());
}

}  // namespace
}  // namespace liquidblend::server::peers_test
