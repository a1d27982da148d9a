// Who makes a call, and what they may do. Knows neither gRPC nor HTTP.
#pragma once

#include <cstdint>
#include <set>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace liquidblend::server {

// What a principal may do beside looking at what there is, which all of them may.
enum class Scope {
  kFrames,    // get and stream frames
  kWrite,     // upload, import and delete animations
  kRegister,  // register and delete families, cancel and delete operations
};

// "frames", "write", "register".
const char* ScopeName(Scope scope);
// Errors: kInvalidArgument.
absl::StatusOr<Scope> ParseScope(absl::string_view name);

// Of one principal, over all of its connections. 0: no limit but the server's.
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
  std::string key;   // what limits count by: the name; of kAnonymous with the host it calls from
  std::set<Scope> scopes;
  PrincipalLimits limits;
};

// Has shown who they are.
inline bool IsKnown(const Principal& principal) {
  return !principal.name.empty() && principal.name != kAnonymous;
}

// Who makes this call.
struct Caller {
  Principal principal;
  // Tells clients apart where they share the server: the principal's name, of an anonymous one the
  // address and port of its connection.
  std::string client;
  std::string request_id;  // the client's own, or made up; for logs
};

// OK, or kPermissionDenied that names the scope (google.rpc.ErrorInfo: SCOPE_MISSING).
absl::Status CheckScope(const Principal& principal, Scope scope);

}  // namespace liquidblend::server
