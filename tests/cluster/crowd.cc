// lb_crowd: many clients of one server. Prints the memory that an idle connection and a stream cost
// it, and the latency of calls while all are connected. Exits with 1 if a client could not connect,
// a call failed or a stream ended.
#include <grpcpp/grpcpp.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "liquidblend/v1/liquidblend.grpc.pb.h"
#include "tests/bench/load_family.h"
#include "tests/bench/load_report.h"
#include "tests/bench/load_server.h"
#include "tests/bench/require.h"
#include "tests/core/store/store_testing.h"

namespace liquidblend::bench {
namespace {

using Clock = std::chrono::steady_clock;
using Stub = v1::LiquidBlend::Stub;
using Stream = grpc::ClientReaderWriter<v1::StreamFramesRequest, v1::StreamFramesResponse>;

struct Flags {
  int clients = 10'000;
  int streams = 1000;
  int vertices = 5000;
  double calls_per_second = 500.0;
  double frames_per_second = 0.5;  // of a stream
  double seconds = 30.0;           // of each part
  int threads = 32;
};

// Runs body(k) for k in [0, count) on several threads.
void ForEach(int num_threads, int count, const std::function<void(int)>& body) {
  std::atomic<int> next = 0;
  std::vector<std::thread> threads;
  for (int t = 0; t < num_threads; ++t) {
    threads.emplace_back([&] {
      for (int k = next++; k < count; k = next++) body(k);
    });
  }
  for (std::thread& thread : threads) thread.join();
}

// A connection of its own, which is made now.
std::unique_ptr<Stub> Connect(const LoadTarget& target, std::atomic<int>& num_unconnected) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  const auto channel =
      grpc::CreateCustomChannel(target.address, grpc::InsecureChannelCredentials(), arguments);
  const auto deadline = std::chrono::system_clock::now() + std::chrono::seconds(30);
  if (!channel->WaitForConnected(deadline)) ++num_unconnected;
  return v1::LiquidBlend::NewStub(channel);
}

// A stream in a loop, and its context.
struct Watch {
  grpc::ClientContext context;
  std::unique_ptr<Stream> stream;
};

std::unique_ptr<Watch> OpenStream(const LoadTarget& target, double frames_per_second, Stub& stub) {
  auto watch = std::make_unique<Watch>();
  watch->stream = stub.StreamFrames(&watch->context);
  v1::StreamFramesRequest request;
  request.set_family(target.family);
  for (int k = 0; k < target.num_weights; ++k) request.add_weights(0.5);
  request.set_loop(true);
  request.set_frames_per_second(frames_per_second);
  watch->stream->Write(request);
  return watch;
}

// Frames that repeat, from all clients by turns, at an even pace.
struct CallReport {
  std::vector<double> ms;
  int num_failed = 0;
};
CallReport Call(const Flags& flags, const LoadTarget& target,
                const std::vector<std::unique_ptr<Stub>>& stubs) {
  const int count = static_cast<int>(flags.calls_per_second * flags.seconds);
  CallReport report;
  report.ms.resize(count);
  std::atomic<int> num_failed = 0;
  const Clock::time_point begin = Clock::now();
  ForEach(flags.threads, count, [&](int k) {
    std::this_thread::sleep_until(begin +
                                  std::chrono::duration_cast<Clock::duration>(
                                      std::chrono::duration<double>(k / flags.calls_per_second)));
    v1::GetFrameRequest request;
    request.set_family(target.family);
    for (int w = 0; w < target.num_weights; ++w) request.add_weights(0.25);
    request.set_time_s(target.duration_s * (k % 16) / 16);
    grpc::ClientContext context;
    v1::Frame frame;
    const Clock::time_point asked = Clock::now();
    // A step that is coprime to most counts, so that successive calls come from clients far apart.
    const size_t client = static_cast<size_t>(k) * 7919 % stubs.size();
    if (!stubs[client]->GetFrame(&context, request, &frame).ok()) ++num_failed;
    report.ms[k] = std::chrono::duration<double, std::milli>(Clock::now() - asked).count();
  });
  report.num_failed = num_failed;
  std::sort(report.ms.begin(), report.ms.end());
  return report;
}

// Prints the report's row; returns how many calls failed.
int Print(const char* what, const CallReport& report) {
  std::printf("| %s | %zu | %.2f | %.2f | %d |\n", what, report.ms.size(),
              Percentile(report.ms, 0.5), Percentile(report.ms, 0.99), report.num_failed);
  std::fflush(stdout);
  return report.num_failed;
}

// Reads frames of all streams for some seconds; returns how many streams had ended.
int ReadFrames(const Flags& flags, const std::vector<std::unique_ptr<Watch>>& watches) {
  std::atomic<int> num_ended = 0;
  const int frames_each = std::max(1, static_cast<int>(flags.frames_per_second * flags.seconds));
  ForEach(flags.threads, static_cast<int>(watches.size()), [&](int k) {
    v1::StreamFramesResponse response;
    for (int frame = 0; frame < frames_each; ++frame) {
      if (watches[k]->stream->Read(&response)) continue;
      ++num_ended;
      return;
    }
  });
  return num_ended;
}

// The server's memory once what it has freed is back with the system (its allocator: 2 s).
MemoryFigures MemoryOf(const LoadServer& server) {
  std::this_thread::sleep_for(std::chrono::seconds(5));
  return Require(server.ReadMemory());
}

int RunAll(const Flags& flags) {
  const store::TemporaryFolder folder;
  Require(MakeLoadFamily(folder.path(), flags.vertices, /*warp_frames=*/0.0));
  const std::unique_ptr<LoadServer> server = Require(LoadServer::Start({.data = folder.path()}));
  const LoadTarget target = Require(server->Target(kLoadFamily));
  std::atomic<int> num_unconnected = 0;
  std::vector<std::unique_ptr<Stub>> stubs;
  stubs.push_back(Connect(target, num_unconnected));
  std::printf(
      "| calls while connected | calls | p50 ms | p99 ms | failed |\n"
      "| --- | --- | --- | --- | --- |\n");
  int num_failed_calls = Print("1 client", Call(flags, target, stubs));

  const MemoryFigures alone = MemoryOf(*server);
  stubs.resize(flags.clients);
  ForEach(flags.threads, flags.clients - 1,
          [&](int k) { stubs[k + 1] = Connect(target, num_unconnected); });
  const MemoryFigures connected = MemoryOf(*server);
  num_failed_calls += Print("all clients", Call(flags, target, stubs));

  const MemoryFigures called = MemoryOf(*server);
  std::vector<std::unique_ptr<Watch>> watches(flags.streams);
  ForEach(flags.threads, flags.streams, [&](int k) {
    watches[k] = OpenStream(target, flags.frames_per_second, *stubs[k % stubs.size()]);
  });
  const int num_ended = ReadFrames(flags, watches);
  const MemoryFigures streaming = MemoryOf(*server);
  for (const auto& watch : watches) watch->context.TryCancel();

  const auto kilobytes = [](double to_mb, double from_mb, int count) {
    return 1e3 * (to_mb - from_mb) / std::max(1, count);
  };
  std::printf(
      "\n| clients | not connected | kB a client | kB a client after calls "
      "| streams | ended | kB a stream |\n| --- | --- | --- | --- | --- | --- | --- |\n"
      "| %d | %d | %.1f | %.1f | %d | %d | %.1f |\n",
      flags.clients, num_unconnected.load(),
      kilobytes(connected.resident_mb, alone.resident_mb, flags.clients),
      kilobytes(called.resident_mb, alone.resident_mb, flags.clients), flags.streams, num_ended,
      kilobytes(streaming.resident_mb, called.resident_mb, flags.streams));
  return num_unconnected + num_failed_calls + num_ended == 0 ? 0 : 1;
}

}  // namespace
}  // namespace liquidblend::bench

int main(int argc, char** argv) {
  CLI::App app("Measures one server with many clients");
  liquidblend::bench::Flags flags;
  app.add_option("--clients", flags.clients, "Connections")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--streams", flags.streams)->capture_default_str();
  app.add_option("--vertices", flags.vertices, "Of a frame")->capture_default_str();
  app.add_option("--calls-per-second", flags.calls_per_second, "Of all clients")
      ->capture_default_str();
  app.add_option("--frames-per-second", flags.frames_per_second, "Of a stream")
      ->capture_default_str();
  app.add_option("--seconds", flags.seconds, "Of each part")->capture_default_str();
  app.add_option("--threads", flags.threads, "Of the clients")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  return liquidblend::bench::RunAll(flags);
}
