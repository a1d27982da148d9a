// The methods of the API for transports other than gRPC, with the same checks and errors. Knows
// neither gRPC nor HTTP.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "absl/functional/any_invocable.h"
#include "absl/status/statusor.h"
#include "core/trace/tracer.h"
#include "liquidblend/v1/liquidblend.pb.h"
#include "server/access/access_controller.h"
#include "server/api/archive_upload.h"
#include "server/api/import_source.h"
#include "server/api/operation_watch.h"
#include "server/api/unary_methods.h"
#include "server/frames/stream_session.h"
#include "server/metrics/metrics.h"

namespace liquidblend::server {

struct MadeFrame {
  v1::Frame frame;
  std::string generation;  // of the family; frames of one query and generation are equal
};

struct FamilyVersion {
  int64_t version = 0;  // 0: none is published yet
  std::string generation;
};

// Nothing here blocks or computes on the caller's thread. A callback is called exactly once, on a
// thread of a pool, or before the call returns (a cached frame, a refusal); it must not block.
// Errors: those of the gRPC methods of the same name (handlers.h, get_frame.h).  Threads: safe.
class Api {
 public:
  template <typename Reply>
  using Done = absl::AnyInvocable<void(absl::StatusOr<Reply>)>;
  using Cancel = std::function<void()>;

  virtual ~Api() = default;

  // Decides whether a call may go on; see AccessController::Admit().
  virtual absl::Status Admit(const Credentials& credentials, const AccessRequest& access,
                             AccessGrant& grant) = 0;

  //   client  the account that is charged
  //   span    of the call
  // Returns a function that ends the call with kCancelled unless it is over.
  virtual Cancel GetFrame(v1::GetFrameRequest request, std::string client, trace::Span span,
                          Done<MadeFrame> done) = 0;
  // The published version; if `version` is not 0 and in memory, that one.
  virtual void FindVersion(const std::string& family, int64_t version,
                           Done<FamilyVersion> done) = 0;
  // Calls a method with one request and one response, but GetFrame.
  //   read       sets the request, on a thread of the method's pool
  //   is_wanted  asked before the method begins, and while it waits
  using Read = absl::AnyInvocable<absl::Status(google::protobuf::Message& request)>;
  virtual void Call(const Method& method, const Caller& caller, Read read, IsWanted is_wanted,
                    Done<MessagePtr> done) = 0;
  // Gives the next change of a watched operation. To be called again once its `done` has been
  // called.
  using NextOperation = std::function<void(Done<SeenOperationPtr>)>;
  virtual NextOperation WatchOperation(const std::string& name, IsWanted is_wanted) = 0;
  // UploadAnimation; see OpenArchiveUpload().
  virtual std::shared_ptr<ArchiveUpload> OpenUpload(v1::UploadAnimationRequest header,
                                                    const Caller& caller) = 0;
  // As StreamFrames.
  virtual std::shared_ptr<StreamSession> OpenStream(std::string client,
                                                    std::weak_ptr<StreamSession::Sink> sink,
                                                    trace::Span span) = 0;

  // Checks whether the server is ready: "ok", or why catalog or blobs cannot be reached, or how far
  // preloading is. Calls within a second share one look at the stores; kUnavailable if they have
  // not answered within 2 s. Uses no thread that other calls need.
  virtual void CheckIsReady(Done<std::string> done) = 0;
  // Metrics in Prometheus' text format; without jobs if the catalog does not answer within 2 s. The
  // catalog is asked at most every 5 seconds. Uses no thread that other calls need.
  virtual void GetMetricsText(Done<std::string> done) = 0;
  // Runs work that computes for long, such as the text of a large message, on a thread for it.
  // Errors, and nothing is run: as WorkPool::Post().
  virtual absl::Status Post(absl::AnyInvocable<void()> work) = 0;
  virtual metrics::Metrics& metrics() = 0;
  virtual CallLog& call_log() = 0;
  virtual const trace::Tracer& tracer() = 0;
};

// All outlive it.
std::unique_ptr<Api> MakeApi(Backends& backends, AccessController& access_controller,
                             const ImportRoots& import_roots);

}  // namespace liquidblend::server
