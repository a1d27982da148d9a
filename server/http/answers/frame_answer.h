// The answer to GET /v1/families/{family}/frame.drc (.ply, .obj, .meshopt): a frame, or 304 if the
// client has it already.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "absl/functional/any_invocable.h"
#include "server/api/api.h"
#include "server/http/exchange/cancellation.h"
#include "server/http/exchange/messages.h"

namespace liquidblend::http {

struct FrameAsk {
  v1::GetFrameRequest request;
  std::string if_none_match;  // the header's value, or empty
  std::string client;         // the account that is charged
  bool is_private = false;    // the answer depends on the caller
  trace::Span span = {};      // of the call
};

// While a family's new version is being loaded, the one before is served. Then two requests for the
// same path may see different versions; a client that has a newer one already does not get an older
// one.
class FrameAnswer : public std::enable_shared_from_this<FrameAnswer> {
 public:
  using Done = absl::AnyInvocable<void(absl::StatusOr<Response>)>;

  // Calls `done` once, at once or on a thread of the API, which outlives the answer.
  static void Start(server::Api& api, FrameAsk ask, std::shared_ptr<Cancellation> cancellation,
                    Done done);

  // For Start() only.
  FrameAnswer(server::Api& api, FrameAsk ask, std::shared_ptr<Cancellation> cancellation, Done done)
      : api_(api),
        ask_(std::move(ask)),
        cancellation_(std::move(cancellation)),
        done_(std::move(done)) {}

 private:
  void Look();
  void Decide(const server::FamilyVersion& published);
  void Make(int64_t version);
  void OnMade(int64_t asked_version, absl::StatusOr<server::MadeFrame> made);
  bool HasClient(const std::string& tag) const;
  void SayUnchanged(const std::string& tag);

  server::Api& api_;
  const FrameAsk ask_;
  const std::shared_ptr<Cancellation> cancellation_;
  // Used by the thread that continues the answer; threads hand it over.
  Done done_;
  int64_t published_ = 0;  // the catalog's version; 0: not looked at
  int num_looks_ = 0;
  int num_made_ = 0;  // frames that the API was asked for
};

}  // namespace liquidblend::http
