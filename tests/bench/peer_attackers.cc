// Attackers who need no token: they use what gRPC does before anybody asks who they are.
#include <grpcpp/grpcpp.h>
#include <zlib.h>

#include <chrono>
#include <deque>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "liquidblend/v1/liquidblend.grpc.pb.h"
#include "tests/bench/attackers.h"
#include "tests/bench/pace.h"
#include "tests/server/grpc/http2_client.h"

namespace liquidblend::bench {
namespace {

using server::Http2Client;
using server::MessagePrefix;
using std::chrono::milliseconds;

constexpr milliseconds kPatience(5000);
constexpr char kGetFamily[] = "/liquidblend.v1.LiquidBlend/GetFamily";

// 64 MiB of zeros, gzipped, as a message of gRPC.
std::string CompressedZeros() {
  constexpr size_t kSize = size_t{64} << 20;
  constexpr int kGzip = 15 + 16;
  const std::string zeros(kSize, '\0');
  z_stream stream = {};
  deflateInit2(&stream, Z_BEST_COMPRESSION, Z_DEFLATED, kGzip, 9, Z_DEFAULT_STRATEGY);
  std::string packed(deflateBound(&stream, kSize), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(zeros.data()));
  stream.avail_in = static_cast<uInt>(zeros.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  deflate(&stream, Z_FINISH);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return MessagePrefix(static_cast<uint32_t>(packed.size()), true) + packed;
}

AttackReport SendCompressedZeros(const AttackTarget& target, const std::stop_token& stop) {
  AttackReport report;
  const std::string message = CompressedZeros();
  for (Turns turns(2, stop); turns.Next(); ++report.num_attempts) {
    Http2Client peer(target.grpc_port());
    const int stream = peer.Open(kGetFamily, {{"grpc-encoding", "gzip"}});
    peer.Send(stream, message, milliseconds(500));
    peer.HalfClose(stream);
    if (!peer.AwaitEnd(stream, kPatience)) ++report.num_wrong;
  }
  return report;
}

// Messages of 4 MiB whose last byte never comes, each in a connection of its own.
AttackReport SendUnfinishedMessages(const AttackTarget& target, const std::stop_token& stop) {
  constexpr size_t kMaxHeld = 5;
  constexpr uint32_t kSize = (4 << 20) - 1;
  const std::string unfinished = MessagePrefix(kSize) + std::string(kSize - 1, 'x');
  AttackReport report;
  std::deque<Http2Client> held;
  for (Turns turns(1, stop); turns.Next(); ++report.num_attempts) {
    if (held.size() == kMaxHeld) held.pop_front();
    Http2Client& peer = held.emplace_back(target.grpc_port());
    peer.Send(peer.Open(kGetFamily), unfinished, milliseconds(200));
  }
  return report;
}

// Calls that get no message, in one connection.
AttackReport OpenManyStreams(const AttackTarget& target, const std::stop_token& stop) {
  constexpr int kStreamsOfOne = 2000;
  AttackReport report;
  std::unique_ptr<Http2Client> peer;
  for (Turns turns(100, stop); turns.Next(); ++report.num_attempts) {
    if (report.num_attempts % kStreamsOfOne == 0 || !peer->is_open()) {
      peer = std::make_unique<Http2Client>(target.grpc_port());
    }
    peer->Open(kGetFamily);
    peer->Receive(milliseconds(0));
  }
  return report;
}

// Calls `path` with one message until the server answers. As gRPC's clients do, calls again in
// another connection where it was told to leave this one. Returns whether there was an answer.
bool CallUntilAnswered(const AttackTarget& target, const std::string& path,
                       const std::string& message, std::unique_ptr<Http2Client>& peer) {
  constexpr int kMaxCalls = 3;
  for (int k = 0; k < kMaxCalls; ++k) {
    if (peer == nullptr) peer = std::make_unique<Http2Client>(target.grpc_port());
    const int stream = peer->Open(path);
    peer->Send(stream, MessagePrefix(static_cast<uint32_t>(message.size())) + message, kPatience);
    peer->HalfClose(stream);
    peer->AwaitEnd(stream, kPatience);
    const bool is_answered = peer->is_answered(stream);
    const bool is_told_to_leave = peer->is_told_to_leave();
    if (is_told_to_leave || !is_answered) peer = nullptr;
    if (is_answered) return true;
    if (!is_told_to_leave) return false;
  }
  return false;
}

// Calls of one method with one message each, in one connection.
AttackReport FloodMethod(const AttackTarget& target, const std::string& path,
                         const std::string& message, double per_second,
                         const std::stop_token& stop) {
  AttackReport report;
  std::unique_ptr<Http2Client> peer;
  for (Turns turns(per_second, stop); turns.Next(); ++report.num_attempts) {
    if (!CallUntilAnswered(target, path, message, peer)) ++report.num_wrong;
  }
  return report;
}

// Streams that wait for a message, each with a thread of gRPC's.
AttackReport HoldReflection(const AttackTarget& target, const std::stop_token& stop) {
  AttackReport report;
  std::unique_ptr<Http2Client> peer;
  for (Turns turns(20, stop); turns.Next(); ++report.num_attempts) {
    if (report.num_attempts % 400 == 0) peer = std::make_unique<Http2Client>(target.grpc_port());
    peer->Open("/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo");
    peer->Receive(milliseconds(0));
  }
  return report;
}

// An import that no worker takes, for others to watch. Empty if the server refuses it.
std::string SubmitImport(v1::LiquidBlend::Stub& stub) {
  grpc::ClientContext context;
  google::longrunning::Operation operation;
  const auto stream = stub.UploadAnimation(&context, &operation);
  v1::UploadAnimationRequest message;
  message.mutable_header()->set_animation_id("watched");
  stream->Write(message);
  message.mutable_file()->set_name("f_1.ply");
  stream->Write(message);
  stream->WritesDone();
  return stream->Finish().ok() ? operation.name() : "";
}

struct Watch {
  grpc::ClientContext context;
  std::unique_ptr<grpc::ClientReader<google::longrunning::Operation>> reader;
};

void End(Watch& watch) {
  watch.context.TryCancel();
  watch.reader->Finish();
}

// Up to 500 watches of one operation, which never changes.
AttackReport FloodWatches(const AttackTarget& target, const std::stop_token& stop) {
  constexpr size_t kMaxWatches = 500;
  AttackReport report;
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  const auto stub = v1::LiquidBlend::NewStub(grpc::CreateCustomChannel(
      target.grpc.address, grpc::InsecureChannelCredentials(), arguments));
  v1::WatchOperationRequest request;
  request.set_name(SubmitImport(*stub));
  if (request.name().empty()) ++report.num_wrong;
  std::deque<Watch> watches;
  for (Turns turns(20, stop); turns.Next(); ++report.num_attempts) {
    if (watches.size() == kMaxWatches) {
      End(watches.front());
      watches.pop_front();
    }
    Watch& watch = watches.emplace_back();
    watch.reader = stub->WatchOperation(&watch.context, request);
    google::longrunning::Operation operation;
    if (!watch.reader->Read(&operation)) ++report.num_wrong;
  }
  for (Watch& watch : watches) End(watch);
  return report;
}

}  // namespace

std::vector<Attacker> PeerAttackers() {
  using Target = const AttackTarget&;
  using Stop = const std::stop_token&;
  const std::string list_services("\x3a\x00", 2);
  return {{"compressed messages", 2, "2/s, 64 KiB that are 64 MiB", SendCompressedZeros},
          {"messages that never end", 1, "1/s, 4 MiB each, 5 open", SendUnfinishedMessages},
          {"streams without a message", 100, "100/s in one connection", OpenManyStreams},
          {"flood of health checks", 50, "50 calls/s",
           [](Target t, Stop stop) {
             return FloodMethod(t, "/grpc.health.v1.Health/Check", "", 50, stop);
           }},
          {"flood of reflection", 20, "20 calls/s",
           [=](Target t, Stop stop) {
             return FloodMethod(t, "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo",
                                list_services, 20, stop);
           }},
          {"idle streams of reflection", 20, "20/s, 400 open", HoldReflection},
          {"flood of watches", 20, "20/s, 500 open", FloodWatches}};
}

}  // namespace liquidblend::bench
