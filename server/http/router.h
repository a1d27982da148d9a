// Router: requests of HTTP -> calls of the Api -> answers. Knows no sockets.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "server/access/principal.h"
#include "server/api/api.h"
#include "server/http/answers/page.h"
#include "server/http/exchange/exchange.h"
#include "server/http/exchange/messages.h"
#include "server/http/exchange/protocols.h"
#include "server/http/exchange/route.h"

namespace liquidblend::http {

struct RouterOptions {
  // The origin whose scripts may read answers and open streams, beside this server's own pages:
  // "https://example.org", "*" for all, or empty.
  std::string allowed_origin;
  // Host names that requests may use, beside IP addresses and localhost; see CheckHost().
  std::vector<std::string> hosts;
  PageFiles page;                                // what is served at "/"
  int64_t max_body_bytes = 4 << 20;              // > 0; of a request
  int64_t max_bodies_bytes = int64_t{64} << 20;  // > 0; of all requests together
  // > 0; of all answers together that have not gone out. A single one may be larger.
  int64_t max_answers_bytes = int64_t{256} << 20;
};

// The caller that opens a WebSocket.
struct StreamVisit {
  server::Caller caller;
  server::StreamPermit permit;  // held for as long as it is open
  Protocols protocols;          // that it offers
};

// The caller of a request before authentication.
server::Caller CallerOf(const Request& request);

// Paths: docs/http.md. All but /healthz and /readyz check the Host and the caller.
// Threads: safe.
class Router {
 public:
  // The API outlives this.
  Router(server::Api& api, RouterOptions options)
      : api_(api),
        options_(std::move(options)),
        page_(options_.page),
        bodies_(std::make_shared<MemoryBudget>(options_.max_bodies_bytes)),
        answers_(std::make_shared<MemoryBudget>(options_.max_answers_bytes)) {}

  // Answers a request by Exchange::Finish(), which calls `done` once: at once, or on a thread of
  // the API. If the result wants a body, its pieces are to be given to it. HEAD gets its body, too,
  // but for files of the page. The result can cancel the work on the answer.
  ExchangePtr Answer(const Request& request, Exchange::Done done);

  // Whether the path is that of the WebSocket.
  bool IsStream(const Request& request) const;

  // Checks whether a WebSocket may be opened, and authenticates the caller in `visit`.
  // Errors: kPermissionDenied for a page of another origin; CheckHost's and Api::Admit()'s.
  absl::Status AdmitStream(const Request& request, StreamVisit& visit);

  // The response to a request that does not reach Answer(), with the common headers, counted and
  // logged like an answer.
  Response Refused(const Request& request, const server::Caller& caller, Response response);

  // Counts and logs a WebSocket that has ended, and ends its span. Without memory for that it does
  // nothing, as the WebSocket's destructor calls it.
  //   close_code  RFC 6455's, CloseCode() or ClientCloseCode(); each one is a series of the metrics
  void NoteStream(const server::Caller& caller, int close_code, absl::string_view reason,
                  absl::Duration took) noexcept;

  // From now on /readyz answers 503.
  void SetDraining() { is_draining_ = true; }

 private:
  Response Completed(const Exchange& exchange, absl::Duration took, Response response) noexcept;
  void Hold(const Exchange& exchange, Response& response);
  void Complete(const Exchange& exchange, absl::Duration took, Response& response);
  absl::Status Admit(const Request& request, const server::AccessRequest& access,
                     server::Caller& caller, server::StreamPermit& permit);
  absl::Status CheckHosts(const Request& request) const;
  trace::Span StartSpan(const Request& request, const std::string& pattern) const;
  bool RefuseUnasked(Exchange& exchange, const std::string& path) const;
  bool Refuse(Exchange& exchange, const std::string& path, const std::string& query);
  void Dispatch(const ExchangePtr& exchange);
  void DispatchMethod(const ExchangePtr& exchange);
  void AnswerReady(const ExchangePtr& exchange);
  void AnswerMetrics(const ExchangePtr& exchange);
  void AnswerFrame(const ExchangePtr& exchange);

  server::Api& api_;
  const RouterOptions options_;
  const Page page_;
  const Routes routes_;
  const std::shared_ptr<MemoryBudget> bodies_;   // of requests
  const std::shared_ptr<MemoryBudget> answers_;  // until they have gone out
  std::atomic<bool> is_draining_ = false;
};

}  // namespace liquidblend::http
