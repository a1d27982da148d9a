// Access control of calls: identity, scope and quotas, for gRPC and HTTP alike.
#pragma once

#include <optional>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "server/access/authorizer.h"
#include "server/access/principal.h"
#include "server/access/quotas.h"

namespace liquidblend::server {

// Proof of identity that comes with a call.
struct Credentials {
  absl::string_view authorization;        // the value of that header, or empty
  absl::string_view certificate_subject;  // as Authorizer::Check() takes it, or empty
  absl::string_view peer;                 // address of the connection
};

// Rights that a call needs.
struct AccessRequest {
  std::optional<Scope> scope;  // none: any principal may
  bool lasts = false;          // counts against max_streams
};

// Result of an admitted call.
struct AccessGrant {
  Principal principal;
  StreamPermit permit;  // to be held until the call ends
};

// Decides whether a call may begin.  Threads: safe.
class AccessController {
 public:
  // `authorizer` outlives it.
  explicit AccessController(const Authorizer& authorizer) : authorizer_(authorizer) {}

  // Counts one call. On errors `grant` has the principal nevertheless, if it is known.
  // Errors: Authorizer::Check()'s, CheckScope()'s, and those of Quotas.
  absl::Status Admit(const Credentials& credentials, const AccessRequest& request,
                     AccessGrant& grant);

  // See Authorizer::Principals().
  std::vector<Principal> Principals() const { return authorizer_.Principals(); }

 private:
  const Authorizer& authorizer_;
  Quotas quotas_;
};

}  // namespace liquidblend::server
