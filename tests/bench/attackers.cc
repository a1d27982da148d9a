#include "tests/bench/attackers.h"

#include <grpcpp/grpcpp.h>

#include <cmath>
#include <deque>
#include <limits>
#include <memory>
#include <random>
#include <utility>

#include "absl/strings/str_cat.h"
#include "liquidblend/v1/liquidblend.grpc.pb.h"
#include "tests/bench/pace.h"
#include "tests/server/http/http_client.h"

namespace liquidblend::bench {
namespace {

using http::HttpClient;
using http::HttpReply;

constexpr int kBinary = 2;  // opcode of a WebSocket's message
constexpr size_t kUnknownBytes = 32 << 10;
constexpr size_t kMaxHeld = 10;  // connections that one attacker holds open

std::string RandomBytes(std::mt19937& random, size_t size) {
  std::string bytes(size, '\0');
  for (char& byte : bytes) byte = static_cast<char>(random());
  return bytes;
}

std::unique_ptr<v1::LiquidBlend::Stub> Connect(const AttackTarget& target) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  arguments.SetMaxReceiveMessageSize(-1);
  return v1::LiquidBlend::NewStub(grpc::CreateCustomChannel(
      target.grpc.address, grpc::InsecureChannelCredentials(), arguments));
}

template <typename Request>
Request OfFamily(const AttackTarget& target) {
  Request request;
  request.set_family(target.grpc.family);
  for (int k = 0; k < target.grpc.num_weights; ++k) request.add_weights(0.0);
  return request;
}

// With a field that the server does not know.
template <typename Request>
Request WithUnknownField(Request request) {
  constexpr int kNumber = 2047;
  request.GetReflection()->MutableUnknownFields(&request)->AddLengthDelimited(kNumber)->assign(
      kUnknownBytes, 'u');
  return request;
}

AttackReport SendRandomBytes(int port, const std::stop_token& stop) {
  AttackReport report;
  std::mt19937 random(port);
  for (Turns turns(10, stop); turns.Next(); ++report.num_attempts) {
    HttpClient client(port);
    client.Send(RandomBytes(random, 16 + random() % 4096));
  }
  return report;
}

AttackReport FloodPath(const AttackTarget& target, const std::string& path, double per_second,
                       const std::stop_token& stop) {
  AttackReport report;
  auto client = std::make_unique<HttpClient>(target.http_port);
  for (Turns turns(per_second, stop); turns.Next(); ++report.num_attempts) {
    const HttpReply reply = client->Get(path);
    if (reply.code != 200) {
      ++report.num_wrong;
      client = std::make_unique<HttpClient>(target.http_port);
    }
  }
  return report;
}

AttackReport SendUnknownByWebSocket(const AttackTarget& target, const std::stop_token& stop) {
  AttackReport report;
  v1::StreamFramesRequest request = OfFamily<v1::StreamFramesRequest>(target);
  request.set_rate(0);
  request.set_frames_per_second(1);
  const std::string bytes = WithUnknownField(request).SerializeAsString();
  std::unique_ptr<HttpClient> client;
  for (Turns turns(50, stop); turns.Next(); ++report.num_attempts) {
    if (client != nullptr && client->SendMessage(kBinary, bytes)) continue;
    client = std::make_unique<HttpClient>(target.http_port);
    if (client->Upgrade().code != 101) ++report.num_wrong;
  }
  return report;
}

AttackReport SendUnknownByGrpc(const AttackTarget& target, const std::stop_token& stop) {
  AttackReport report;
  v1::StreamFramesRequest request = OfFamily<v1::StreamFramesRequest>(target);
  request.set_rate(0);
  request.set_frames_per_second(1);
  request = WithUnknownField(request);
  const auto stub = Connect(target);
  Turns turns(50, stop);
  while (!stop.stop_requested()) {
    grpc::ClientContext context;
    const auto stream = stub->StreamFrames(&context);
    while (turns.Next() && stream->Write(request)) ++report.num_attempts;
    context.TryCancel();
    stream->Finish();
  }
  return report;
}

AttackReport SendUnknownInCalls(const AttackTarget& target, const std::stop_token& stop) {
  AttackReport report;
  const v1::GetFrameRequest request = WithUnknownField(OfFamily<v1::GetFrameRequest>(target));
  const auto stub = Connect(target);
  for (Turns turns(20, stop); turns.Next(); ++report.num_attempts) {
    grpc::ClientContext context;
    v1::Frame frame;
    const grpc::Status status = stub->GetFrame(&context, request, &frame);
    if (status.error_code() == grpc::StatusCode::INTERNAL) ++report.num_wrong;
  }
  return report;
}

// WebSockets at 240 frames/s whose client never reads.
AttackReport NeverRead(const AttackTarget& target, const std::stop_token& stop) {
  AttackReport report;
  v1::StreamFramesRequest request = OfFamily<v1::StreamFramesRequest>(target);
  request.set_loop(true);
  request.set_frames_per_second(240);
  std::deque<HttpClient> held;
  for (Turns turns(0.5, stop); turns.Next(); ++report.num_attempts) {
    if (held.size() == kMaxHeld) held.pop_front();
    HttpClient& client = held.emplace_back(target.http_port);
    if (client.Upgrade().code != 101) ++report.num_wrong;
    client.SendMessage(kBinary, request.SerializeAsString());
  }
  return report;
}

// Many requests for frames in one connection whose client reads no answer.
AttackReport PipelineWithoutReading(const AttackTarget& target, const std::stop_token& stop) {
  constexpr int kNumRequests = 40;
  AttackReport report;
  const std::string request =
      absl::StrCat("GET /v1/", target.grpc.family, "/frame.drc?weights=0&time=0 HTTP/1.1\r\n",
                   "Host: localhost\r\n\r\n");
  std::string all;
  for (int k = 0; k < kNumRequests; ++k) all += request;
  std::deque<HttpClient> held;
  for (Turns turns(1, stop); turns.Next(); ++report.num_attempts) {
    if (held.size() == kMaxHeld) held.pop_front();
    held.emplace_back(target.http_port).Send(all);
  }
  return report;
}

AttackReport ConnectAndDrop(const AttackTarget& target, const std::stop_token& stop) {
  AttackReport report;
  const int ports[] = {target.grpc_port(), target.http_port};
  for (Turns turns(40, stop); turns.Next(); ++report.num_attempts) {
    const HttpClient client(ports[report.num_attempts % 2]);
    if (!client.is_connected()) ++report.num_wrong;
  }
  return report;
}

// Begins of requests whose rest never comes.
AttackReport SendHalfRequests(const AttackTarget& target, const std::stop_token& stop) {
  const std::string halves[] = {"GET /v1/fam", "GET /healthz HTTP/1.1\r\nHost: localhost\r\nX: ",
                                "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", std::string("\0\0", 2)};
  const int ports[] = {target.http_port, target.http_port, target.grpc_port(), target.grpc_port()};
  AttackReport report;
  std::deque<HttpClient> held;
  for (Turns turns(4, stop); turns.Next(); ++report.num_attempts) {
    if (held.size() == 4 * kMaxHeld) held.pop_front();
    const auto kind = static_cast<size_t>(report.num_attempts % 4);
    held.emplace_back(ports[kind]).Send(halves[kind]);
  }
  return report;
}

// Paces that are tiny, huge or no numbers. Those that are taken are held open.
AttackReport AskForExtremePaces(const AttackTarget& target, const std::stop_token& stop) {
  constexpr double kLargest = std::numeric_limits<double>::max();
  const double rates[] = {1e-300, 1e-15, 1e-10, 1e-3, 240, 1e308, -1, std::nan(""), 0};
  const double speeds[] = {1, 0, -0.0, 1000, -1000, kLargest, 5e-324, HUGE_VAL};
  AttackReport report;
  std::deque<HttpClient> held;
  for (Turns turns(4, stop); turns.Next(); ++report.num_attempts) {
    v1::StreamFramesRequest request = OfFamily<v1::StreamFramesRequest>(target);
    request.set_loop(true);
    request.set_frames_per_second(rates[report.num_attempts % std::size(rates)]);
    request.set_rate(speeds[report.num_attempts % std::size(speeds)]);
    if (held.size() == kMaxHeld) held.pop_front();
    HttpClient& client = held.emplace_back(target.http_port);
    if (client.Upgrade().code != 101) ++report.num_wrong;
    client.SendMessage(kBinary, request.SerializeAsString());
  }
  return report;
}

// One whole file and half of another, then the client goes away.
AttackReport BreakOffUploads(const AttackTarget& target, const std::stop_token& stop) {
  constexpr size_t kChunk = 32 << 10;
  AttackReport report;
  std::mt19937 random(1);
  const auto stub = Connect(target);
  for (Turns turns(4, stop); turns.Next(); ++report.num_attempts) {
    grpc::ClientContext context;
    google::longrunning::Operation operation;
    const auto stream = stub->UploadAnimation(&context, &operation);
    v1::UploadAnimationRequest message;
    message.mutable_header()->set_animation_id("broken");
    stream->Write(message);
    for (const int num_chunks : {1, 2}) {
      message.mutable_file()->set_name(absl::StrCat("f_", num_chunks, ".ply"));
      message.mutable_file()->set_size_bytes(static_cast<int64_t>(num_chunks * kChunk));
      stream->Write(message);
      message.set_chunk(RandomBytes(random, kChunk));
      stream->Write(message);
    }
    context.TryCancel();
    if (stream->Finish().ok()) ++report.num_wrong;
  }
  return report;
}

// Makes a client of load_clients.h an attacker.
template <typename Client>
auto Of(Client client) {
  return [client](const AttackTarget& target, const std::stop_token& stop) {
    const ClientReport seen = client(target.grpc, stop);
    return AttackReport{std::ssize(seen.latencies_ms), seen.num_errors};
  };
}

}  // namespace

std::vector<Attacker> AllAttackers() {
  using Target = const AttackTarget&;
  using Stop = const std::stop_token&;
  std::vector<Attacker> all = {
      {"random bytes to the gRPC port", 10, "10 connections/s, 2 KiB each",
       [](Target t, Stop stop) { return SendRandomBytes(t.grpc_port(), stop); }},
      {"random bytes to the HTTP port", 10, "10 connections/s, 2 KiB each",
       [](Target t, Stop stop) { return SendRandomBytes(t.http_port, stop); }},
      {"malformed calls and weights", 100, "100 of each a second",
       Of([](const LoadTarget& t, Stop stop) { return SendGarbage(t, 1, stop); })},
      {"unknown fields, WebSocket", 50, "50 messages/s, 32 KiB each", SendUnknownByWebSocket},
      {"unknown fields, gRPC stream", 50, "50 messages/s, 32 KiB each", SendUnknownByGrpc},
      {"unknown fields, calls", 20, "20 calls/s, 32 KiB each", SendUnknownInCalls},
      {"flood of /readyz", 200, "200 requests/s",
       [](Target t, Stop stop) { return FloodPath(t, "/readyz", 200, stop); }},
      {"flood of /metrics", 50, "50 requests/s",
       [](Target t, Stop stop) { return FloodPath(t, "/metrics", 50, stop); }},
      {"stream read slowly", 2, "60 frames/s asked for, 2 read",
       Of([](const LoadTarget& t, Stop stop) { return WatchSlowly(t, stop); })},
      {"WebSockets never read", 0.5, "10 open, 240 frames/s asked for", NeverRead},
      {"requests whose answers are never read", 1, "10 open, 40 requests/s",
       PipelineWithoutReading},
      {"clients that vanish in mid-call", 4, "4 streams and calls/s",
       Of([](const LoadTarget& t, Stop stop) { return Vanish(t, 1, stop); })},
      {"connections that are dropped", 40, "40/s", ConnectAndDrop},
      {"half requests", 4, "4/s, 40 open", SendHalfRequests},
      {"tiny and huge paces", 4, "4 streams/s, 10 open", AskForExtremePaces},
      {"uploads that break off", 4, "4/s, 64 KiB each", BreakOffUploads}};
  for (Attacker& attacker : PeerAttackers()) all.push_back(std::move(attacker));
  return all;
}

}  // namespace liquidblend::bench
