// An exchange: a request and the answer to it, while it is being made. Knows no sockets.
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/functional/any_invocable.h"
#include "absl/status/statusor.h"
#include "server/access/principal.h"
#include "server/access/quotas.h"
#include "server/base/guarded.h"
#include "server/http/exchange/body.h"
#include "server/http/exchange/cancellation.h"
#include "server/http/exchange/messages.h"
#include "server/http/exchange/route.h"
#include "server/transcode/query.h"

namespace liquidblend::http {

// Owned by a shared_ptr. The router fills it in before anybody else has it.  Threads: Finish() and
// Cancel() safe, the others one at a time.
class Exchange {
 public:
  using Done = absl::AnyInvocable<void(Response)>;

  Exchange(Request sent, Route met, server::Caller who)
      : request(std::move(sent)), route(std::move(met)), caller(std::move(who)) {}

  // Sets what gets the answer. To be called before Finish().
  void SetDone(Done done) { done_ = std::move(done); }

  // Gives the answer; only the first one counts.
  void Finish(Response response) {
    if (is_finished_.exchange(true)) return;
    permit = nullptr;
    Done done = std::exchange(done_, nullptr);
    done(std::move(response));
  }
  bool is_finished() const { return is_finished_; }

  // The error as the answer, with the resource among its details. If there is no memory for that,
  // an empty answer.
  void Fail(const absl::Status& error, int http_code = 0);

  // Gives the answer that make() returns; an exception of it becomes an error.
  template <typename Make>
  void FinishBy(Make&& make) {
    absl::StatusOr<Response> made =
        server::Guarded([&]() -> absl::StatusOr<Response> { return make(); });
    made.ok() ? Finish(*std::move(made)) : Fail(made.status());
  }

  // The client has gone.
  void Cancel() { cancellation->Cancel(); }

  const Request request;
  const Route route;
  server::Caller caller;
  server::StreamPermit permit;  // until the answer, of a call that lasts
  std::vector<transcode::QueryField> fields;
  std::string resource;            // that the request is about, once it is known
  std::unique_ptr<BodySink> body;  // null: no body is to be read
  const std::shared_ptr<Cancellation> cancellation = std::make_shared<Cancellation>();

 private:
  std::atomic<bool> is_finished_ = false;
  Done done_;
};

using ExchangePtr = std::shared_ptr<Exchange>;

}  // namespace liquidblend::http
