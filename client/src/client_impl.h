// Implementation of Client: its servers, and calls with retries. Includes gRPC: only for the
// sources that make calls.
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
#include "client/src/connection/trace_headers.h"
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

  // The longest timeout that is a deadline: gRPC's clock ends in the year 2262. Longer ones are
  // none.
  static constexpr absl::Duration kLongestTimeout = absl::Hours(24 * 365 * 100);

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
    client::Server* any = nullptr;
    return Call(method, request, timeout, &any);
  }
  // Likewise, with `*preferred` first; see Servers::TryEach().
  template <typename Stub, typename Request, typename Response>
  absl::StatusOr<Response> Call(grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&,
                                                             Response*),
                                const Request& request, absl::Duration timeout,
                                client::Server** preferred) {
    Response response;
    const auto call = [&](client::Server& server) {
      grpc::ClientContext context;
      Prepare(timeout, &context);
      return client::FromGrpc((std::get<Stub>(server.stubs).*method)(&context, request, &response));
    };
    const absl::Status status = TryAll(call, preferred);
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
    const auto call = [&](client::Server& server) {
      grpc::ClientContext context;
      Prepare(options.call_timeout, &context);
      google::protobuf::Empty empty;
      const absl::Status status =
          client::FromGrpc((std::get<Stub>(server.stubs).*method)(&context, request, &empty));
      const bool may_be_done = std::exchange(is_repeated, true);
      return may_be_done && absl::IsNotFound(status) ? absl::OkStatus() : status;
    };
    client::Server* any = nullptr;
    return TryAll(call, &any);
  }

  // Runs `call`, which may be repeated, until it succeeds, fails for another reason than
  // kUnavailable, or the attempts are used up, or patience is. An attempt is Servers::TryEach().
  absl::Status TryAll(const std::function<absl::Status(client::Server& server)>& call,
                      client::Server** preferred) {
    const auto attempt = [&] { return servers->TryEach(call, preferred); };
    if (options.retry.is_patient) return client::RetryPatiently(options.retry, attempt);
    return client::RetryUnavailable(options.retry, [&](int) { return attempt(); });
  }

  // operations.cc: likewise for `call` that submits an operation with a request id, as long as
  // RetryOptions::patience. If it is not known in the end whether the server has accepted it, the
  // message tells the user where to look.
  absl::Status Submit(const std::function<absl::Status(client::Server& server)>& call);

  // upload.cc: sends the files directly to the object store. Returns their upload ids, in order;
  // none if the server gives no urls or they cannot be reached, so that the files must go to the
  // server.
  absl::StatusOr<std::vector<std::string>> SendDirectly(
      const UploadRequest& upload, const std::vector<client::UploadFile>& files,
      const std::function<void(const UploadProgress&)>& report);

  // download.cc: a stored file, part by part through the server. Returns its size.
  absl::StatusOr<int64_t> ReadFile(const std::string& name, const std::string& path,
                                   int64_t version);

  // operations.cc: returns the operation, and notes its version, so that later frames are not
  // older.
  Operation NoteVersion(Operation operation);

  // operations.cc: watches an operation at one server, as Client::WatchOperation() does.
  // Errors: kUnavailable if the connection is lost; `backoff` begins anew with every message.
  absl::StatusOr<Operation> WatchAt(client::Server& server,
                                    const v1::WatchOperationRequest& request,
                                    const std::function<bool(const Operation&)>& update,
                                    absl::Time deadline, client::PatientBackoff& backoff);

  // operations.cc: waits until every other reachable server serves the version that the
  // registration has published.  Errors: kDeadlineExceeded after call_timeout or patience,
  // whichever is longer, and at `end`.
  absl::Status AwaitOtherServers(const Operation& operation, const client::Server& asked,
                                 absl::Time end);
  // Waits for one server. OK, too, if it cannot be reached, or does not know the operation.
  absl::Status AwaitVersion(const Operation& operation, client::Server& server,
                            absl::Time deadline);

  // Sets the credentials, the trace and the deadline of a call.
  void Prepare(absl::Duration timeout, grpc::ClientContext* context) const {
    const std::string& token = options.security.token;
    if (!token.empty()) context->AddMetadata("authorization", "Bearer " + token);
    if (options.trace) client::AddTrace(options.trace(), context);
    if (timeout > kLongestTimeout) return;
    context->set_deadline(std::chrono::system_clock::now() + absl::ToChronoMicroseconds(timeout));
  }

  const ConnectOptions options;
  const std::unique_ptr<client::Servers> servers;
  client::KnownVersions known_versions;
};

}  // namespace liquidblend
