// The gRPC server: listens, answers, and drains before it stops.
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "core/store/blobs/blob_store.h"
#include "core/store/catalog/catalog.h"
#include "server/access/authorizer.h"
#include "server/api/api.h"
#include "server/api/import_source.h"
#include "server/catalog/families.h"
#include "server/frames/backends.h"
#include "server/grpc/tls.h"

namespace liquidblend::server {

struct ServerOptions {
  std::string listen = "127.0.0.1:50051";          // HOST:PORT; port 0: any free one
  int num_io_threads = 4;                          // >= 1; for the catalog, and again for blobs
  int num_frame_threads = 2;                       // >= 1; compute frames
  int max_waiting_calls = 1000;                    // >= 1; for an io thread; more are refused
  FrameQueueOptions queue;                         // frames that wait to be made; more are refused
  int64_t frame_cache_bytes = int64_t{256} << 20;  // >= 0; encoded frames
  UnreadAnswersOptions unread;                     // answers on their way to clients
  int max_message_bytes = 4 << 20;                 // >= 64 KiB; of requests
  // >= 16 MiB; connections, and requests that have not arrived whole, of all peers together. gRPC
  // ends streams beyond it.
  int64_t max_buffer_bytes = int64_t{128} << 20;
  // >= 1 s, or 0: without limit. Then a client's connection is ended (GOAWAY) once its calls are
  // over, so that the client looks which servers there are, and connects again.
  absl::Duration connection_age = absl::Seconds(30);
  // >= 0. How long families may be loaded before health says SERVING; 0: none are loaded.
  absl::Duration preload_time = absl::ZeroDuration();
  Limits limits;
  std::shared_ptr<Authorizer> authorizer;       // none: everyone may do everything
  std::shared_ptr<const trace::Tracer> tracer;  // none: calls are not traced
  TlsOptions tls;
  ImportRoots import_roots;       // where clients may import animations from
  bool allow_insecure = false;    // without TLS, listen elsewhere than on the loopback, too
  absl::Status Validate() const;  // names the first field out of range, and its value
};

// Threads: safe.
class Server {
 public:
  // Listens and serves, with health checking and reflection. While families are preloaded, calls
  // are answered already. The stores and families outlive it.
  // Errors: kInvalidArgument (options), kFailedPrecondition if it cannot listen there.
  static absl::StatusOr<std::unique_ptr<Server>> Start(store::Catalog& catalog,
                                                       store::BlobStore& blobs,
                                                       liquidblend::catalog::Families& families,
                                                       const ServerOptions& options);
  ~Server();  // Drain() without patience

  // The methods for other transports; lives as long as this.
  Api& api();

  // HOST:PORT with the port that was chosen.
  const std::string& address() const;
  int port() const;

  // Stops in good order: health becomes NOT_SERVING, and clients that watch it leave. A moment
  // later new calls and streams end with kUnavailable and google.rpc.RetryInfo, and other calls may
  // finish within `patience`. Idempotent.
  void Drain(absl::Duration patience);

 private:
  struct Impl;
  explicit Server(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace liquidblend::server
