// What transports other than gRPC answer from: the same methods, checks and errors, with neither
// gRPC nor HTTP.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "absl/functional/any_invocable.h"
#include "absl/status/statusor.h"
#include "liquidblend/v1/liquidblend.pb.h"
#include "server/access/access_controller.h"
#include "server/frames/stream_session.h"
#include "server/metrics/metrics.h"

namespace liquidblend::server {

struct MadeFrame {
  v1::Frame frame;
  std::string generation;  // what it was made from: frames of one query and generation are the same
};

struct FamilyVersion {
  int64_t version = 0;  // 0: none is published yet
  std::string generation;
};

// Nothing here blocks or computes on the caller's thread. A callback is called exactly once, on a
// thread of a pool, or before the call returns (a frame that is kept, a refusal); it must not
// block.
// Errors: those of the gRPC methods of the same name (handlers.h, get_frame.h).  Threads: safe.
class FrameSource {
 public:
  template <typename Reply>
  using Done = absl::AnyInvocable<void(absl::StatusOr<Reply>)>;
  using Cancel = std::function<void()>;

  virtual ~FrameSource() = default;

  // As AccessController::Admit().
  virtual absl::Status Admit(const Credentials& credentials, const AccessRequest& access,
                             AccessGrant& grant) = 0;

  //   client  who is charged for it
  // Returns what ends the call with kCancelled unless it is over.
  virtual Cancel GetFrame(v1::GetFrameRequest request, std::string client,
                          Done<MadeFrame> done) = 0;
  // The version that is published; of another one than 0 that is in memory, that one.
  virtual void FindVersion(const std::string& family, int64_t version,
                           Done<FamilyVersion> done) = 0;
  virtual void GetFamily(v1::GetFamilyRequest request, Done<v1::Family> done) = 0;
  virtual void ListFamilies(v1::ListFamiliesRequest request,
                            Done<v1::ListFamiliesResponse> done) = 0;
  // As StreamFrames.
  virtual std::shared_ptr<StreamSession> OpenStream(std::string client,
                                                    std::weak_ptr<StreamSession::Sink> sink) = 0;

  // "ok", or why catalog or blobs cannot be reached. Whoever asks within a second hears the same;
  // kUnavailable if they have not answered within 2 s. Takes no thread that calls need.
  virtual void CheckStores(Done<std::string> done) = 0;
  // Metrics in Prometheus' text format; without jobs if the catalog does not answer within 2 s.
  // The catalog is asked every 5 seconds at most. Takes no thread that calls need.
  virtual void GetMetricsText(Done<std::string> done) = 0;
  virtual metrics::Metrics& metrics() = 0;
  virtual CallLog& call_log() = 0;
};

// Both outlive it.
std::unique_ptr<FrameSource> MakeFrameSource(Backends& backends,
                                             AccessController& access_controller);

}  // namespace liquidblend::server
