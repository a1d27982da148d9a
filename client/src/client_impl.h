// What a Client holds: its servers, and how a call is made. Includes gRPC: only for the sources
// that make calls.
#pragma once

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "client/src/known_versions.h"
#include "client/src/retry.h"
#include "client/src/servers.h"
#include "client/src/status.h"
#include "client/src/upload_files.h"
#include "liquidblend/client.h"

namespace liquidblend {

class Client::Impl {
 public:
  using Service = client::ServiceStub;
  using Operations = client::OperationsStub;

  Impl(const ConnectOptions& connect_options, std::unique_ptr<client::Servers> open_servers)
      : options(connect_options), servers(std::move(open_servers)) {}

  // Makes a call that may be repeated, with the retries of the options and, unless another timeout
  // is given, that of short calls.
  template <typename Stub, typename Request, typename Response>
  absl::StatusOr<Response> Call(grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&,
                                                             Response*),
                                const Request& request) {
    return Call(method, request, options.call_timeout);
  }
  template <typename Stub, typename Request, typename Response>
  absl::StatusOr<Response> Call(grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&,
                                                             Response*),
                                const Request& request, absl::Duration timeout) {
    Response response;
    absl::Status status = TryAll([&](client::Server& server) {
      grpc::ClientContext context;
      Prepare(timeout, &context);
      return client::FromGrpc((std::get<Stub>(server.stubs).*method)(&context, request, &response));
    });
    if (!status.ok()) return status;
    return response;
  }

  // Likewise for a request that carries a request id; see Submit() below.
  template <typename Request, typename Response>
  absl::StatusOr<Response> Submit(grpc::Status (Service::*method)(grpc::ClientContext*,
                                                                  const Request&, Response*),
                                  const Request& request, absl::Duration timeout) {
    Response response;
    const absl::Status status = Submit([&](client::Server& server) {
      grpc::ClientContext context;
      Prepare(timeout, &context);
      return client::FromGrpc((server.service().*method)(&context, request, &response));
    });
    if (!status.ok()) return status;
    return response;
  }

  // Likewise for a deletion: not found at a second attempt means that the first one did it.
  template <typename Stub, typename Request>
  absl::Status CallDelete(grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&,
                                                       google::protobuf::Empty*),
                          const Request& request) {
    bool is_repeated = false;
    return TryAll([&](client::Server& server) {
      grpc::ClientContext context;
      Prepare(options.call_timeout, &context);
      google::protobuf::Empty empty;
      const absl::Status status =
          client::FromGrpc((std::get<Stub>(server.stubs).*method)(&context, request, &empty));
      const bool may_be_done = std::exchange(is_repeated, true);
      return may_be_done && absl::IsNotFound(status) ? absl::OkStatus() : status;
    });
  }

  // Runs `call`, which may be repeated, until it succeeds, fails for another reason than
  // kUnavailable, or the attempts are used up. An attempt asks every server once.
  absl::Status TryAll(const std::function<absl::Status(client::Server& server)>& call) {
    return client::RetryUnavailable(options.retry, [&](int) { return servers->TryEach(call); });
  }

  // operations.cc: likewise for `call` that submits an operation with a request id, as long as
  // RetryOptions::patience. If it is not known in the end whether the server has taken it, the
  // message says where to look.
  absl::Status Submit(const std::function<absl::Status(client::Server& server)>& call);

  // upload.cc: sends the files past the server; what it calls them, in their order. None if the
  // server gives no urls, or they lead nowhere: then the files go to the server.
  absl::StatusOr<std::vector<std::string>> SendDirectly(
      const UploadRequest& upload, const std::vector<client::UploadFile>& files,
      const std::function<void(const UploadProgress&)>& report);

  // operations.cc: the same, and later frames are not older than what it says.
  Operation NoteVersion(Operation operation);

  // operations.cc: until every other server that can be reached serves the version that the
  // registration has published.  Errors: kDeadlineExceeded after call_timeout or patience,
  // whichever is longer.
  absl::Status AwaitOtherServers(const Operation& operation, const client::Server& asked);
  // One of them. OK, too, if it cannot be reached, or does not know the operation.
  absl::Status AwaitVersion(const Operation& operation, client::Server& server,
                            absl::Time deadline);

  // Says who calls, and until when an answer is of use.
  void Prepare(absl::Duration timeout, grpc::ClientContext* context) const {
    const std::string& token = options.security.token;
    if (!token.empty()) context->AddMetadata("authorization", "Bearer " + token);
    if (timeout == absl::InfiniteDuration()) return;
    context->set_deadline(std::chrono::system_clock::now() + absl::ToChronoMicroseconds(timeout));
  }

  const ConnectOptions options;
  const std::unique_ptr<client::Servers> servers;
  client::KnownVersions known_versions;
};

}  // namespace liquidblend
