// Whether a call may begin, whichever way it comes. Knows neither gRPC nor HTTP.
#pragma once

#include <optional>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "server/access/authorizer.h"
#include "server/access/principal.h"
#include "server/access/quotas.h"

namespace liquidblend::server {

// What a caller shows.
struct Visitor {
  absl::string_view authorization;        // the value of that header, or empty
  absl::string_view certificate_subject;  // as Authorizer::Check() takes it, or empty
  absl::string_view peer;                 // address of the connection
};

// What a caller wants.
struct Errand {
  std::optional<Scope> scope;  // none: any principal may
  bool lasts = false;          // counts against max_streams
};

// Whom to answer.
struct Admitted {
  Principal principal;
  StreamPermit permit;  // to be held for as long as it lasts
};

// Threads: safe.
class Entrance {
 public:
  // `authorizer` outlives it.
  explicit Entrance(const Authorizer& authorizer) : authorizer_(authorizer) {}

  // Counts one call. On errors `admitted` has the principal nevertheless, if that is known.
  // Errors: Authorizer::Check()'s, CheckScope()'s, and those of Quotas.
  absl::Status Enter(const Visitor& visitor, const Errand& errand, Admitted& admitted);

 private:
  const Authorizer& authorizer_;
  Quotas quotas_;
};

}  // namespace liquidblend::server
