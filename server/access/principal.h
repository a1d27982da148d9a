// Principals and callers, their scopes and limits. Knows neither gRPC nor HTTP.
#pragma once

#include <cstdint>
#include <set>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/trace/span.h"

namespace liquidblend::server {

// Rights of a principal beside reading, which all of them may.
enum class Scope {
  kFrames,    // get and stream frames
  kWrite,     // upload, import and delete animations
  kRegister,  // register and delete families, cancel and delete operations
};

// "frames", "write", "register".
const char* ScopeName(Scope scope);
// Errors: kInvalidArgument.
absl::StatusOr<Scope> ParseScope(absl::string_view name);

// Limits of one principal, over all of its connections. 0: no limit but the server's.
struct PrincipalLimits {
  int64_t max_upload_bytes = 0;    // >= 0; of one upload or import
  int max_streams = 0;             // >= 0; calls that may last, at a time: streams of frames,
                                   // uploads, imports, watched or awaited operations
  double requests_per_second = 0;  // >= 0; calls, on average over seconds
  int64_t max_stored_bytes = 0;    // >= 0; owner_limits.h
  int64_t max_queued_jobs = 0;     // >= 0; owner_limits.h
  absl::Status Validate() const;   // names the first field out of range, and its value
};

inline constexpr char kAnonymous[] = "anonymous";

struct Principal {
  std::string name;  // from the tokens file, or a certificate's subject, or kAnonymous
  std::string key;   // key of its quotas: the name; for kAnonymous with its host
  std::set<Scope> scopes;
  PrincipalLimits limits;
};

// Whether the principal is authenticated.
inline bool IsKnown(const Principal& principal) {
  return !principal.name.empty() && principal.name != kAnonymous;
}

// The caller of one call.
struct Caller {
  Principal principal;
  // Name of the client for fair shares of the server: the principal's name, or for an anonymous one
  // the address and port of its connection.
  std::string client;
  std::string request_id;  // the client's own, or made up; for logs
  trace::Span span;        // of the call; what it begins belongs to the same trace
};

// OK, or kPermissionDenied that names the scope (google.rpc.ErrorInfo: SCOPE_MISSING).
absl::Status CheckScope(const Principal& principal, Scope scope);

}  // namespace liquidblend::server
