#include "server/rpc/server.h"

#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>

#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "core/base/status_macros.h"
#include "server/rpc/services.h"

namespace liquidblend::rpc {
namespace {

constexpr int kMinMessageBytes = 64 << 10;
constexpr int kKeepaliveMs = 30'000;

absl::Status OutOfRange(absl::string_view field, int value) {
  return absl::InvalidArgumentError(
      absl::StrCat("server option ", field, " is out of range: ", value));
}

// What a port was asked for, with the one that was chosen.
std::string AddressWithPort(const std::string& listen, int port) {
  return absl::StrCat(listen.substr(0, listen.rfind(':')), ":", port);
}

}  // namespace

absl::Status ServerOptions::Validate() const {
  if (num_io_threads < 1) return OutOfRange("num_io_threads", num_io_threads);
  if (num_frame_threads < 1) return OutOfRange("num_frame_threads", num_frame_threads);
  if (max_waiting_calls < 1) return OutOfRange("max_waiting_calls", max_waiting_calls);
  if (max_message_bytes < kMinMessageBytes) {
    return OutOfRange("max_message_bytes", max_message_bytes);
  }
  if (listen.rfind(':') == std::string::npos) {
    return absl::InvalidArgumentError(
        absl::StrCat("server option listen must be HOST:PORT, got '", listen, "'"));
  }
  return limits.Validate();
}

struct Server::Impl {
  Impl(store::Catalog& catalog, store::BlobStore& blobs, liquidblend::catalog::Families& families,
       const ServerOptions& options)
      : backends{catalog,
                 blobs,
                 families,
                 options.limits,
                 {},
                 {options.num_io_threads, options.max_waiting_calls},
                 {options.num_frame_threads, options.max_waiting_calls}},
        service(backends, calls),
        operations(backends, calls) {}

  absl::Status Listen(const ServerOptions& options) {
    grpc::EnableDefaultHealthCheckService(true);
    grpc::reflection::InitProtoReflectionServerBuilderPlugin();
    grpc::ServerBuilder builder;
    // Two servers on one port must not share its connections by accident.
    builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
    // A client that has vanished without a word holds its call no longer than this.
    builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, kKeepaliveMs);
    builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kKeepaliveMs);
    builder.SetMaxReceiveMessageSize(options.max_message_bytes);
    builder.SetMaxSendMessageSize(-1);
    builder.AddListeningPort(options.listen, grpc::InsecureServerCredentials(), &port);
    builder.RegisterService(&service);
    builder.RegisterService(&operations);
    server = builder.BuildAndStart();
    if (server == nullptr || port == 0) {
      return absl::UnavailableError(absl::StrCat("cannot listen on ", options.listen,
                                                 ": in use, or no address of this machine"));
    }
    address = AddressWithPort(options.listen, port);
    for (const char* name : {"", v1::LiquidBlend::service_full_name(),
                             google::longrunning::Operations::service_full_name()}) {
      server->GetHealthCheckService()->SetServingStatus(name, true);
    }
    return absl::OkStatus();
  }

  OpenCalls calls;
  Backends backends;
  LiquidBlendService service;
  OperationsService operations;
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
  return std::unique_ptr<Server>(new Server(std::move(impl)));
}

Server::Server(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Server::~Server() { Drain(absl::ZeroDuration()); }

const std::string& Server::address() const { return impl_->address; }

int Server::port() const { return impl_->port; }

void Server::Drain(absl::Duration patience) {
  impl_->server->GetHealthCheckService()->Shutdown();
  impl_->calls.CloseAll(absl::UnavailableError("the server is shutting down"));
  impl_->server->Shutdown(absl::ToChronoTime(absl::Now() + patience));
  impl_->backends.io.Stop();
  impl_->backends.frames.Stop();
}

}  // namespace liquidblend::rpc
