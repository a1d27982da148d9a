#include "tests/bench/load_clients.h"

#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <memory>
#include <random>
#include <thread>

#include "liquidblend/v1/liquidblend.grpc.pb.h"

namespace liquidblend::bench {
namespace {

constexpr int kNumRepeated = 16;

double MsBetween(Clock::time_point begin, Clock::time_point end) {
  return std::chrono::duration<double, std::milli>(end - begin).count();
}

Clock::time_point Before(Clock::time_point end, double ms) {
  return end -
         std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double, std::milli>(ms));
}

// A connection of its own, as clients on different machines have.
std::shared_ptr<grpc::Channel> Connect(const LoadTarget& target) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  arguments.SetMaxReceiveMessageSize(-1);
  return grpc::CreateCustomChannel(target.address, grpc::InsecureChannelCredentials(), arguments);
}

// Numbers that spread evenly over [0, 1).
double Spread(int64_t k) { return std::fmod(static_cast<double>(k) * 0.6180339887498949, 1.0); }

// Another number for each call, so that no client finds what another one has asked for before.
int64_t NextNumber() {
  static std::atomic<int64_t> number = kNumRepeated;
  return number++;
}

// Weights that spread evenly over each target's range.
template <typename Request>
void AddWeights(const LoadTarget& target, int64_t n, Request& request) {
  for (int k = 0; k < target.num_weights; ++k) {
    request.add_weights(Spread(n + 7 * k) / target.num_weights);
  }
}

v1::GetFrameRequest FrameRequest(const LoadTarget& target, int64_t n) {
  v1::GetFrameRequest request;
  request.set_family(target.family);
  AddWeights(target, n, request);
  return request;
}

v1::StreamFramesRequest StreamRequest(const LoadTarget& target, double frames_per_second) {
  v1::StreamFramesRequest request;
  request.set_family(target.family);
  AddWeights(target, 1, request);
  request.set_loop(true);
  request.set_frames_per_second(frames_per_second);
  return request;
}

// Calls at even times, from any point of the first period on; those that come too late follow at
// once.
class Pace {
 public:
  explicit Pace(double per_second) {
    if (per_second <= 0.0) return;
    period_ = std::chrono::duration_cast<Clock::duration>(
        std::chrono::duration<double>(1.0 / per_second));
    next_ += std::chrono::duration_cast<Clock::duration>(period_ * Spread(NextNumber()));
  }
  void Wait() {
    if (period_ == Clock::duration::zero()) return;
    std::this_thread::sleep_until(next_);
    next_ += period_;
  }

 private:
  Clock::duration period_ = Clock::duration::zero();
  Clock::time_point next_ = Clock::now();
};

void Count(const v1::Frame& frame, ClientReport& report) {
  report.num_bytes += static_cast<int64_t>(frame.data().size());
  report.num_vertices += frame.num_vertices();
  report.num_triangles += frame.num_triangles();
}

}  // namespace

ClientReport CallFrames(const LoadTarget& target, const Calls& calls, const std::stop_token& stop) {
  const auto stub = v1::LiquidBlend::NewStub(Connect(target));
  ClientReport report;
  Pace pace(calls.per_second);
  for (int64_t k = 0; !stop.stop_requested(); ++k) {
    pace.Wait();
    const int64_t n = calls.frames == Frames::kRepeated ? k % kNumRepeated : NextNumber();
    v1::GetFrameRequest request = FrameRequest(target, n);
    request.set_time_s(target.duration_s * Spread(3 * n + 1));
    request.mutable_encoding()->set_preset(calls.preset);
    grpc::ClientContext context;
    v1::Frame frame;
    const Clock::time_point begin = Clock::now();
    if (!stub->GetFrame(&context, request, &frame).ok()) {
      ++report.num_errors;
      continue;
    }
    report.latencies_ms.push_back(MsBetween(begin, Clock::now()));
    Count(frame, report);
  }
  return report;
}

ClientReport WatchStream(const LoadTarget& target, double frames_per_second,
                         const std::stop_token& stop) {
  const auto stub = v1::LiquidBlend::NewStub(Connect(target));
  grpc::ClientContext context;
  const auto stream = stub->StreamFrames(&context);
  stream->Write(StreamRequest(target, frames_per_second));
  ClientReport report;
  const double period_ms = 1000.0 / frames_per_second;
  std::vector<Clock::time_point> arrivals;
  std::vector<double> behind_ms;  // the pace of the very first frame
  v1::StreamFramesResponse response;
  const Clock::time_point begin = Clock::now();
  while (!stop.stop_requested() && stream->Read(&response)) {
    const auto tick = static_cast<double>(response.frame_index() + response.num_dropped());
    arrivals.push_back(Clock::now());
    behind_ms.push_back(MsBetween(begin, arrivals.back()) - tick * period_ms);
    report.num_dropped = response.num_dropped();
    Count(response.frame(), report);
    v1::StreamFramesRequest change;
    AddWeights(target, NextNumber(), change);
    stream->Write(change);
  }
  if (!stop.stop_requested()) ++report.num_errors;
  context.TryCancel();
  stream->Finish();
  if (arrivals.empty()) return report;
  const double first = *std::min_element(behind_ms.begin(), behind_ms.end());
  for (size_t k = 0; k < arrivals.size(); ++k) {
    const double late_ms = behind_ms[k] - first;
    report.latencies_ms.push_back(late_ms);
    if (late_ms > period_ms) report.late.push_back({Before(arrivals[k], late_ms), arrivals[k]});
  }
  return report;
}

ClientReport WatchSlowly(const LoadTarget& target, const std::stop_token& stop) {
  const auto stub = v1::LiquidBlend::NewStub(Connect(target));
  grpc::ClientContext context;
  const auto stream = stub->StreamFrames(&context);
  stream->Write(StreamRequest(target, 60));
  ClientReport report;
  v1::StreamFramesResponse response;
  while (!stop.stop_requested() && stream->Read(&response)) {
    report.num_dropped = response.num_dropped();
    report.latencies_ms.push_back(0.0);  // only counted
    Count(response.frame(), report);
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
  }
  if (!stop.stop_requested()) ++report.num_errors;
  context.TryCancel();
  stream->Finish();
  return report;
}

ClientReport Vanish(const LoadTarget& target, int client, const std::stop_token& stop) {
  ClientReport report;
  for (int64_t k = client; !stop.stop_requested(); ++k) {
    const auto stub = v1::LiquidBlend::NewStub(Connect(target));
    grpc::ClientContext context;
    const auto stream = stub->StreamFrames(&context);
    stream->Write(StreamRequest(target, 60));
    v1::StreamFramesResponse response;
    for (int64_t read = 0; read < k % 5; ++read) stream->Read(&response);
    context.TryCancel();
    stream->Finish();
    const v1::GetFrameRequest request = FrameRequest(target, NextNumber());
    grpc::ClientContext hurried;
    hurried.set_deadline(std::chrono::system_clock::now() + std::chrono::milliseconds(k % 4));
    v1::Frame frame;
    stub->GetFrame(&hurried, request, &frame);
    report.latencies_ms.push_back(0.0);  // only counted
    std::this_thread::sleep_for(std::chrono::milliseconds(250));
  }
  return report;
}

ClientReport SendGarbage(const LoadTarget& target, int client, const std::stop_token& stop) {
  const auto channel = Connect(target);
  const auto stub = v1::LiquidBlend::NewStub(channel);
  grpc::GenericStub generic(channel);
  std::mt19937 random(client);
  ClientReport report;
  while (!stop.stop_requested()) {
    std::string bytes(random() % 200, '\0');
    for (char& byte : bytes) byte = static_cast<char>(random());
    const grpc::Slice slice(bytes);
    const grpc::ByteBuffer buffer(&slice, 1);
    grpc::ClientContext context;
    grpc::CompletionQueue queue;
    const auto call =
        generic.PrepareUnaryCall(&context, "/liquidblend.v1.LiquidBlend/GetFrame", buffer, &queue);
    call->StartCall();
    grpc::ByteBuffer reply;
    grpc::Status status;
    call->Finish(&reply, &status, &report);
    void* tag = nullptr;
    bool ok = false;
    queue.Next(&tag, &ok);
    if (status.error_code() != grpc::StatusCode::INVALID_ARGUMENT) ++report.num_errors;
    v1::GetFrameRequest request = FrameRequest(target, 1);
    request.set_weights(0, 1e9);
    grpc::ClientContext other;
    v1::Frame frame;
    const grpc::Status refused = stub->GetFrame(&other, request, &frame);
    if (refused.error_code() != grpc::StatusCode::INVALID_ARGUMENT) ++report.num_errors;
    report.latencies_ms.push_back(0.0);  // only counted
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return report;
}

}  // namespace liquidblend::bench
