// Client's calls for long-running operations.
#include <algorithm>
#include <memory>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "client/src/client_impl.h"
#include "client/src/convert.h"
#include "client/src/names.h"
#include "client/src/pages.h"
#include "client/src/status_macros.h"
#include "liquidblend/client.h"

namespace liquidblend {
namespace {

constexpr absl::Duration kPause = absl::Milliseconds(200);  // while a server cannot answer

template <typename Request>
Request OperationRequest(const std::string& name) {
  Request request;
  request.set_name(client::ResourceName("operations", name));
  return request;
}

// "`liquidblend operations ID FLAGS` verb", with no name to copy that a shell would run.
std::string HowToSee(const std::string& operation, const char* flags, const char* verb) {
  if (!client::IsSafeToPaste(operation)) return "`liquidblend operations` lists it";
  return absl::StrCat("`liquidblend operations ", operation, flags, "` ", verb);
}

// Adds advice to the error of a lost connection.
absl::Status LostSight(const std::string& operation, const absl::Status& status) {
  if (!absl::IsUnavailable(status)) return status;
  return absl::UnavailableError(
      absl::StrCat(status.message(), "; ", operation,
                   " may go on nevertheless: ", HowToSee(operation, " --wait", "watches it")));
}

}  // namespace

absl::StatusOr<Operation> Client::GetOperation(const std::string& name) {
  const auto request = OperationRequest<google::longrunning::GetOperationRequest>(name);
  const auto operation = impl_->Call(&Impl::Operations::GetOperation, request);
  if (!operation.ok()) return LostSight(request.name(), operation.status());
  LBC_ASSIGN_OR_RETURN(Operation found, client::FromProto(*operation));
  return impl_->NoteVersion(std::move(found));
}

absl::StatusOr<std::vector<Operation>> Client::ListOperations() {
  std::vector<Operation> operations;
  google::longrunning::ListOperationsRequest request;
  request.set_name("operations");
  const auto fetch = [&](const google::longrunning::ListOperationsRequest& next) {
    return impl_->Call(&Impl::Operations::ListOperations, next);
  };
  const auto items = [](const auto& page) -> auto& { return page.operations(); };
  const auto take = [&](const google::longrunning::Operation& operation) -> absl::Status {
    LBC_ASSIGN_OR_RETURN(Operation found, client::FromProto(operation));
    operations.push_back(impl_->NoteVersion(std::move(found)));
    return absl::OkStatus();
  };
  LBC_RETURN_IF_ERROR(client::ForEachItem(request, fetch, items, take));
  return operations;
}

absl::Status Client::CancelOperation(const std::string& name) {
  const auto request = OperationRequest<google::longrunning::CancelOperationRequest>(name);
  return LostSight(request.name(),
                   impl_->Call(&Impl::Operations::CancelOperation, request).status());
}

absl::Status Client::Impl::Submit(const std::function<absl::Status(client::Server& server)>& call) {
  const absl::Status status =
      client::RetryPatiently(options.retry, [&] { return servers->TryEach(call); });
  if (!absl::IsUnavailable(status) && !absl::IsDeadlineExceeded(status)) return status;
  return absl::Status(
      status.code(),
      absl::StrCat(status.message(),
                   "; it may have been accepted nevertheless: `liquidblend operations` lists it"));
}

Operation Client::Impl::NoteVersion(Operation operation) {
  if (operation.done && operation.result.ok() && operation.version > 0) {
    known_versions.Note(operation.subject, operation.version);
  }
  return operation;
}

absl::Status Client::Impl::AwaitVersion(const Operation& operation, client::Server& server,
                                        absl::Time deadline) {
  for (;;) {
    grpc::ClientContext context;
    Prepare(std::max(deadline - absl::Now(), absl::ZeroDuration()), &context);
    const auto stream = server.service().WatchOperation(
        &context, OperationRequest<v1::WatchOperationRequest>(operation.name));
    google::longrunning::Operation message;
    while (stream->Read(&message)) {
    }
    const absl::Status status = client::FromGrpc(stream->Finish());
    // It answers, but what it needs for that is away (its catalog), or it is busy.
    const bool is_transient =
        client::RetryDelay(status).has_value() ||
        (absl::IsUnavailable(status) && server.channel->GetState(false) == GRPC_CHANNEL_READY);
    if (!is_transient && !absl::IsDeadlineExceeded(status)) return absl::OkStatus();
    if (absl::Now() >= deadline) return absl::DeadlineExceededError(status.message());
    if (is_transient) absl::SleepFor(kPause);
  }
}

absl::Status Client::Impl::AwaitOtherServers(const Operation& operation,
                                             const client::Server& asked, absl::Time end) {
  if (!operation.result.ok() || operation.version == 0) return absl::OkStatus();
  const absl::Duration timeout =
      std::clamp(absl::Trunc(end - absl::Now(), absl::Milliseconds(1)), absl::ZeroDuration(),
                 std::max(options.call_timeout, options.retry.patience));
  const absl::Time deadline = absl::Now() + timeout;
  for (client::Server* const server : servers->All()) {
    if (server->address == asked.address) continue;
    const absl::Status status = AwaitVersion(operation, *server, deadline);
    if (status.ok()) continue;
    return absl::DeadlineExceededError(
        absl::StrCat(operation.name, " has published version ", operation.version, " of ",
                     operation.subject, ", but the server at ", server->address,
                     " does not serve it after ", absl::FormatDuration(timeout), ": ",
                     status.message(), "; ", HowToSee(operation.name, "", "shows the operation")));
  }
  return absl::OkStatus();
}

absl::StatusOr<Operation> Client::Impl::WatchAt(client::Server& server,
                                                const v1::WatchOperationRequest& request,
                                                const std::function<bool(const Operation&)>& update,
                                                absl::Time deadline,
                                                client::PatientBackoff& backoff) {
  grpc::ClientContext context;
  Prepare(std::max(deadline - absl::Now(), absl::ZeroDuration()), &context);
  const auto stream = server.service().WatchOperation(&context, request);
  google::longrunning::Operation message;
  while (stream->Read(&message)) {
    backoff.Reset();
    absl::StatusOr<Operation> operation = client::FromProto(message);
    if (operation.ok()) {
      operation = NoteVersion(*std::move(operation));
      const bool go_on = !update || update(*operation);
      if (!operation->done && go_on) continue;
    }
    context.TryCancel();
    stream->Finish();  // says cancelled, which is known
    LBC_RETURN_IF_ERROR(operation.status());
    if (!operation->done) return absl::CancelledError("stopped watching");
    LBC_RETURN_IF_ERROR(AwaitOtherServers(*operation, server, deadline));
    return operation;
  }
  const absl::Status status = client::FromGrpc(stream->Finish());
  if (absl::IsDeadlineExceeded(status) && deadline != absl::InfiniteFuture()) {
    return absl::DeadlineExceededError(absl::StrCat("the server at ", server.address,
                                                    " has not said that ", request.name(),
                                                    " is done: ", status.message()));
  }
  if (!status.ok()) return status;
  return absl::UnavailableError("the server stopped reporting " + request.name());
}

absl::StatusOr<Operation> Client::WatchOperation(
    const std::string& name, const std::function<bool(const Operation&)>& update,
    absl::Duration timeout) {
  const absl::Time deadline = absl::Now() + timeout;
  const auto request = OperationRequest<v1::WatchOperationRequest>(name);
  client::PatientBackoff backoff(impl_->options.retry);
  while (true) {
    absl::StatusOr<Operation> seen;
    const absl::Status status = impl_->servers->TryEach([&](client::Server& server) {
      seen = impl_->WatchAt(server, request, update, deadline, backoff);
      return seen.status();
    });
    if (status.ok()) return seen;
    const std::optional<absl::Duration> pause = backoff.NextPause(status, absl::Now());
    if (!pause.has_value()) return LostSight(request.name(), status);
    const absl::Duration left = deadline - absl::Now();
    absl::SleepFor(std::min(*pause, left));
    if (*pause >= left) return absl::DeadlineExceededError(status.message());
  }
}

absl::StatusOr<Operation> Client::WaitOperation(const std::string& name) {
  return WatchOperation(name, nullptr);
}

}  // namespace liquidblend
