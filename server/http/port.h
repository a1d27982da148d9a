// The HTTP port: listens, answers requests by the router, carries streams over WebSockets, and
// drains before it stops.
#pragma once

#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "server/api/api.h"
#include "server/http/router.h"

namespace liquidblend::http {

struct PortOptions {
  std::string listen = "127.0.0.1:8080";  // HOST:PORT; port 0: any free one; HOST may be [IPv6]
  RouterOptions router;
  int num_threads = 2;               // >= 1; move bytes and find frames in memory, make none
  int max_connections = 1000;        // >= 1; more are closed at once
  int max_header_bytes = 8 << 10;    // [256, 1 MiB]; of a request
  int max_message_bytes = 64 << 10;  // [256, 64 MiB]; of a WebSocket's client
  // > 0. Until a request's header must be whole, from the connection's begin or the last answer on;
  // for each 64 KiB of a body.
  // A WebSocket's client from which nothing comes is pinged after half of it, and closed after all
  // of it.
  absl::Duration idle_timeout = absl::Seconds(30);
  absl::Duration write_timeout = absl::Seconds(60);  // > 0; until an answer must have gone out
  absl::Duration close_timeout = absl::Seconds(10);  // > 0; of a WebSocket's begin and end
  absl::Status Validate() const;  // names the first field out of range, and its value
};

// Threads: safe.
class Port {
 public:
  // Listens and serves. The API outlives this.
  // Errors: kInvalidArgument (options), kFailedPrecondition if it cannot listen there.
  static absl::StatusOr<std::unique_ptr<Port>> Start(server::Api& api, const PortOptions& options);
  ~Port();  // Stop() without patience

  // HOST:PORT with the port that was chosen.
  const std::string& address() const;
  int port() const;

  // /readyz answers 503, WebSockets are closed with 1001 (going away); other requests are answered
  // as before.
  void Drain();

  // Drain(); accepts no new connections; running answers may finish within `patience`. Idempotent.
  void Stop(absl::Duration patience);

 private:
  struct Impl;
  explicit Port(std::shared_ptr<Impl> impl);
  std::shared_ptr<Impl> impl_;
};

}  // namespace liquidblend::http
