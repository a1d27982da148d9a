// Router: requests of HTTP -> calls of the FrameSource -> answers. Knows no sockets.
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/functional/any_invocable.h"
#include "absl/status/status.h"
#include "absl/time/time.h"
#include "server/access/principal.h"
#include "server/api/frame_source.h"
#include "server/http/cancellation.h"
#include "server/http/messages.h"

namespace liquidblend::http {

struct RouterOptions {
  // The origin whose scripts may read answers and open streams, beside this server's own pages:
  // "https://example.org", "*" for all, or empty.
  std::string allowed_origin;
  // Host names that requests may use, beside IP addresses and localhost; see CheckHost().
  std::vector<std::string> hosts;
};

// The caller that opens a WebSocket.
struct StreamVisit {
  server::Caller caller;
  server::StreamPermit permit;  // held for as long as it is open
};

// The caller of a request before authentication.
server::Caller CallerOf(const Request& request);

// Paths: docs/operations/http.md. All but /healthz and /readyz check the Host and the caller.
// Threads: safe.
class Router {
 public:
  using Done = absl::AnyInvocable<void(Response)>;

  // The source outlives this.
  Router(server::FrameSource& source, RouterOptions options)
      : source_(source), options_(std::move(options)) {}

  // Calls `done` once, at once or on a thread of the source. HEAD gets its body, too. The result
  // can cancel the work on the answer.
  std::shared_ptr<Cancellation> Answer(const Request& request, Done done);

  // Whether the path is that of the WebSocket.
  static bool IsStream(const Request& request);

  // Checks whether a WebSocket may be opened, and authenticates the caller in `visit`.
  // Errors: kPermissionDenied for a page of another origin; CheckHost's and FrameSource::Admit()'s.
  absl::Status AdmitStream(const Request& request, StreamVisit& visit);

  // The response to a request that does not reach Answer(), with the common headers, counted and
  // logged like an answer.
  Response Refused(const Request& request, const server::Caller& caller, Response response);

  // Counts and logs a WebSocket that has ended.
  //   close_code  RFC 6455's, or as CloseCode()
  void NoteStream(const server::Caller& caller, int close_code, const std::string& reason,
                  absl::Duration took);

  // From now on /readyz answers 503.
  void SetDraining() { is_draining_ = true; }

 private:
  struct Call;  // a request that is being answered

  void Complete(const Request& request, const server::Caller& caller, absl::Duration took,
                Response& response);
  absl::Status Admit(const Request& request, const server::AccessRequest& access,
                     server::Caller& caller, server::StreamPermit& permit);
  absl::Status CheckHosts(const Request& request) const;
  void AnswerTo(Call call, const std::string& path, const std::string& query);
  void Dispatch(Call call);
  void AnswerReady(Call call);
  void AnswerMetrics(Call call);
  void AnswerFamilies(Call call);
  void AnswerFamily(Call call);
  void AnswerFrame(Call call);

  server::FrameSource& source_;
  const RouterOptions options_;
  std::atomic<bool> is_draining_ = false;
};

}  // namespace liquidblend::http
