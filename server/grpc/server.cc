#include "server/grpc/server.h"

#include <google/protobuf/stubs/logging.h>
#include <grpc/support/log.h>
#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/resource_quota.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "core/base/log.h"
#include "core/base/status_macros.h"
#include "server/access/access_controller.h"
#include "server/base/errors.h"
#include "server/frames/find_family.h"
#include "server/grpc/count_calls.h"
#include "server/grpc/fallbacks.h"
#include "server/grpc/open_calls.h"
#include "server/grpc/services.h"

namespace liquidblend::server {
namespace {

constexpr int kMinMessageBytes = 64 << 10;
constexpr int64_t kMinBufferBytes = int64_t{16} << 20;
constexpr int64_t kMinRequestsInBuffer = 4;  // of the largest size, whatever the limit
constexpr int kReadAheadBytes = 1 << 20;     // of a stream, beside the message that is read
constexpr int kKeepaliveMs = 30'000;
constexpr int kHandshakeMs = 20'000;         // until TLS and HTTP/2 have begun
constexpr int kIdleMs = 5 * 60'000;          // connections without a call end
constexpr int kMaxConcurrentStreams = 1000;  // of a connection; further calls wait in the client
// Each stream of server reflection that is open keeps one; further ones are refused.
constexpr int kMaxReflectionThreads = 8;
constexpr int kShortestPingIntervalMs = 1'000;  // of clients whose calls wait
constexpr int64_t kMaxLogLines = 10;            // of gRPC's warnings, a second
constexpr absl::Duration kShortestConnection = absl::Seconds(1);
constexpr absl::Duration kLongestConnection = absl::Hours(24);
// For clients that watch the health to go to other servers, before calls are refused.
constexpr absl::Duration kNotice = absl::Milliseconds(100);
// For clients to receive the status of calls that a shutdown ends, before gRPC itself ends.
constexpr absl::Duration kDrainGrace = absl::Milliseconds(250);

absl::Status OutOfRangeOption(absl::string_view field, int64_t value) {
  return absl::InvalidArgumentError(
      absl::StrCat("server option ", field, " is out of range: ", value));
}

absl::Status OutOfRangeOption(absl::string_view field, absl::Duration value) {
  return absl::InvalidArgumentError(
      absl::StrCat("server option ", field, " is out of range: ", absl::FormatDuration(value)));
}

BackendsOptions BackendsOptionsOf(const ServerOptions& options) {
  std::function<absl::StatusOr<absl::Time>()> certificate_expiry;
  if (options.tls.is_on()) {
    certificate_expiry = [tls = options.tls] { return CertificateExpiry(tls); };
  }
  return {.limits = options.limits,
          .certificate_expiry = std::move(certificate_expiry),
          .num_io_threads = options.num_io_threads,
          .num_frame_threads = options.num_frame_threads,
          .max_waiting_calls = options.max_waiting_calls,
          .queue = options.queue,
          .frame_cache_bytes = options.frame_cache_bytes,
          .unread = options.unread,
          .tracer = options.tracer};
}

// Whether one more warning of gRPC's may be logged within this second. The limit is the process's,
// as gRPC has one log for all servers and channels in it.
bool AllowLogLine() {
  static std::atomic<int64_t> second = 0;
  static std::atomic<int64_t> num_lines = 0;
  const int64_t now = absl::ToUnixSeconds(absl::Now());
  if (second.exchange(now) != now) {
    const int64_t num_more = num_lines.exchange(0) - kMaxLogLines;
    if (num_more > 0) base::LogWarning(absl::StrCat(num_more, " more warnings of gRPC left out"));
  }
  return ++num_lines <= kMaxLogLines;
}

// Writes gRPC's own log lines (failed handshakes, mostly) in the form of ours.
void LogForGrpc(gpr_log_func_args* args) {
  const bool is_error = args->severity == GPR_LOG_SEVERITY_ERROR;
  if (is_error && !AllowLogLine()) return;
  base::Log(is_error ? base::LogLevel::kWarning : base::LogLevel::kDebug,
            CleanText(args->message, 1000), {{"source", "grpc"}});
}

// Likewise protobuf's, which report requests that do not parse.
void LogForProtobuf(google::protobuf::LogLevel, const char*, int, const std::string& message) {
  base::Log(base::LogLevel::kDebug, CleanText(message), {{"source", "protobuf"}});
}

// Bounds on what a peer may use before anybody knows who it is.
void LimitPeers(const ServerOptions& options, grpc::ServerBuilder& builder) {
  // gRPC compares the size of a compressed message with its limit before it decompresses it.
  builder.AddChannelArgument(GRPC_ARG_ENABLE_PER_MESSAGE_DECOMPRESSION, 0);
  builder.SetCompressionAlgorithmSupportStatus(GRPC_COMPRESS_DEFLATE, false);
  builder.SetCompressionAlgorithmSupportStatus(GRPC_COMPRESS_GZIP, false);
  // By itself gRPC takes 4 MiB ahead of each stream's reader: quickly too much of calls that wait.
  builder.AddChannelArgument(GRPC_ARG_HTTP2_BDP_PROBE, 0);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, kReadAheadBytes);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, kMaxConcurrentStreams);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_IDLE_MS, kIdleMs);
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, kHandshakeMs);
  // Streams that are open go on for as long as they like.
  if (options.connection_age > absl::ZeroDuration()) {
    builder.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_AGE_MS,
                               static_cast<int>(absl::ToInt64Milliseconds(options.connection_age)));
  }
  grpc::ResourceQuota quota("server");
  quota.Resize(static_cast<size_t>(
      std::max(options.max_buffer_bytes, kMinRequestsInBuffer * options.max_message_bytes)));
  quota.SetMaxThreads(kMaxReflectionThreads);
  builder.SetResourceQuota(quota);
}

// The listening address with the chosen port.
std::string AddressWithPort(const std::string& listen, int port) {
  return absl::StrCat(listen.substr(0, listen.rfind(':')), ":", port);
}

}  // namespace

absl::Status ServerOptions::Validate() const {
  if (num_io_threads < 1) return OutOfRangeOption("num_io_threads", num_io_threads);
  if (num_frame_threads < 1) return OutOfRangeOption("num_frame_threads", num_frame_threads);
  if (max_waiting_calls < 1) return OutOfRangeOption("max_waiting_calls", max_waiting_calls);
  if (frame_cache_bytes < 0) return OutOfRangeOption("frame_cache_bytes", frame_cache_bytes);
  if (max_message_bytes < kMinMessageBytes) {
    return OutOfRangeOption("max_message_bytes", max_message_bytes);
  }
  if (max_buffer_bytes < kMinBufferBytes) {
    return OutOfRangeOption("max_buffer_bytes", max_buffer_bytes);
  }
  if (connection_age != absl::ZeroDuration() &&
      (connection_age < kShortestConnection || connection_age > kLongestConnection)) {
    return OutOfRangeOption("connection_age", connection_age);
  }
  if (preload_time < absl::ZeroDuration()) return OutOfRangeOption("preload_time", preload_time);
  if (listen.rfind(':') == std::string::npos) {
    return absl::InvalidArgumentError(
        absl::StrCat("server option listen must be HOST:PORT, got '", listen, "'"));
  }
  LB_RETURN_IF_ERROR(queue.Validate());
  LB_RETURN_IF_ERROR(tls.Validate());
  if (!tls.is_on() && !allow_insecure && !IsLoopback(listen)) {
    return absl::InvalidArgumentError(absl::StrCat(
        "other machines can reach ", listen,
        ", and all that is said there can be read and changed on the way: give --tls-cert and "
        "--tls-key, listen on 127.0.0.1, or say --insecure if the network itself protects it"));
  }
  return limits.Validate();
}

struct Server::Impl {
  Impl(store::Catalog& catalog, store::BlobStore& blobs, liquidblend::catalog::Families& families,
       const ServerOptions& options)
      : backends(catalog, blobs, families, BackendsOptionsOf(options)),
        authorizer(options.authorizer != nullptr ? options.authorizer
                                                 : std::make_shared<const Authorizer>()),
        import_roots(options.import_roots),
        service(backends, interceptor, import_roots),
        operations(backends, interceptor) {}

  absl::Status Listen(const ServerOptions& options) {
    gpr_set_log_function(LogForGrpc);
    google::protobuf::SetLogHandler(LogForProtobuf);
    grpc::EnableDefaultHealthCheckService(true);
    grpc::reflection::InitProtoReflectionServerBuilderPlugin();
    grpc::ServerBuilder builder;
    // Two servers on one port must not share its connections by accident.
    builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
    // A client that has vanished without a word holds its call no longer than this.
    builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, kKeepaliveMs);
    builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kKeepaliveMs);
    LimitPeers(options, builder);
    builder.AddChannelArgument(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);  // no limit
    // Watches may be silent for long; gRPC takes pings in 5 minutes of silence for abuse.
    builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS,
                               kShortestPingIntervalMs);
    builder.SetMaxReceiveMessageSize(options.max_message_bytes);
    builder.SetMaxSendMessageSize(-1);
    builder.AddListeningPort(options.listen, ServerCredentialsOf(options.tls), &port);
    builder.RegisterService(&service);
    builder.RegisterService(&operations);
    builder.RegisterCallbackGenericService(&unknown_methods);
    Interceptors interceptors;
    interceptors.push_back(std::make_unique<ErrorCompleterFactory>(backends.call_log));
    interceptors.push_back(CountCalls(backends.metrics));  // as they are answered in the end
    builder.experimental().SetInterceptorCreators(std::move(interceptors));
    server = builder.BuildAndStart();
    if (server == nullptr || port == 0) {
      return absl::FailedPreconditionError(
          absl::StrCat("cannot listen on ", options.listen,
                       ": in use, or no address of this machine; stop what listens there, or give "
                       "another --listen"));
    }
    address = AddressWithPort(options.listen, port);
    return absl::OkStatus();
  }

  void SetHealth(bool is_serving) {
    for (const char* name : {"", v1::LiquidBlend::service_full_name(),
                             google::longrunning::Operations::service_full_name()}) {
      server->GetHealthCheckService()->SetServingStatus(name, is_serving);
    }
  }

  void GetReady(absl::Duration preload_time) {
    if (preload_time == absl::ZeroDuration()) return SetHealth(true);
    SetHealth(false);
    Preload(backends, preload_time, [this] { SetHealth(true); });
  }

  OpenCalls calls;
  Backends backends;
  const std::shared_ptr<const Authorizer> authorizer;
  AccessController access_controller{*authorizer};
  CallInterceptor interceptor{access_controller, calls, backends.call_log, *backends.tracer};
  const ImportRoots import_roots;
  std::unique_ptr<Api> api = MakeApi(backends, access_controller, import_roots);
  LiquidBlendService service;
  OperationsService operations;
  UnknownMethods unknown_methods{backends.call_log};
  int port = 0;
  std::string address;
  std::unique_ptr<grpc::Server> server;
};

absl::StatusOr<std::unique_ptr<Server>> Server::Start(store::Catalog& catalog,
                                                      store::BlobStore& blobs,
                                                      liquidblend::catalog::Families& families,
                                                      const ServerOptions& options) {
  LB_RETURN_IF_ERROR(options.Validate());
  auto impl = std::make_unique<Impl>(catalog, blobs, families, options);
  LB_RETURN_IF_ERROR(impl->Listen(options));
  impl->GetReady(options.preload_time);
  KeepFamiliesFresh(impl->backends);
  KeepUsesRecorded(impl->backends);
  return std::unique_ptr<Server>(new Server(std::move(impl)));
}

Server::Server(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Server::~Server() { Drain(absl::ZeroDuration()); }

Api& Server::api() { return *impl_->api; }

const std::string& Server::address() const { return impl_->address; }

int Server::port() const { return impl_->port; }

void Server::Drain(absl::Duration patience) {
  impl_->server->GetHealthCheckService()->Shutdown();
  RecordUses(impl_->backends);
  absl::SleepFor(std::min(patience / 8, kNotice));
  impl_->interceptor.Close();
  impl_->calls.CloseAll(ShuttingDown());
  // Once gRPC shuts down, open calls end with a bare CANCELLED, for which clients do not try
  // another server. So clients get time to receive our status before.
  absl::SleepFor(std::min(patience / 4, kDrainGrace));
  // gRPC itself would wait for watchers of the health, too, who never end.
  impl_->interceptor.AwaitCalls(patience);
  impl_->server->Shutdown(absl::ToChronoTime(absl::Now() + std::min(patience, kDrainGrace)));
  impl_->backends.Stop();
}

}  // namespace liquidblend::server
