// The part of Client that deals with long-running operations.
#include <memory>

#include "client/src/client_impl.h"
#include "client/src/convert.h"
#include "client/src/names.h"
#include "client/src/status_macros.h"
#include "liquidblend/client.h"

namespace liquidblend {
namespace {

constexpr int kPageSize = 1000;

template <typename Request>
Request OperationRequest(const std::string& name) {
  Request request;
  request.set_name(client::ResourceName("operations", name));
  return request;
}

}  // namespace

absl::StatusOr<Operation> Client::GetOperation(const std::string& name) {
  LBC_ASSIGN_OR_RETURN(
      const google::longrunning::Operation operation,
      impl_->Call(&Impl::Operations::GetOperation,
                  OperationRequest<google::longrunning::GetOperationRequest>(name)));
  return client::FromProto(operation);
}

absl::StatusOr<std::vector<Operation>> Client::ListOperations() {
  std::vector<Operation> operations;
  google::longrunning::ListOperationsRequest request;
  request.set_name("operations");
  request.set_page_size(kPageSize);
  do {
    LBC_ASSIGN_OR_RETURN(const google::longrunning::ListOperationsResponse page,
                         impl_->Call(&Impl::Operations::ListOperations, request));
    for (const google::longrunning::Operation& operation : page.operations()) {
      operations.push_back(client::FromProto(operation));
    }
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
  return operations;
}

absl::Status Client::CancelOperation(const std::string& name) {
  return impl_
      ->Call(&Impl::Operations::CancelOperation,
             OperationRequest<google::longrunning::CancelOperationRequest>(name))
      .status();
}

absl::StatusOr<Operation> Client::WatchOperation(
    const std::string& name, const std::function<bool(const Operation&)>& update) {
  const auto request = OperationRequest<v1::WatchOperationRequest>(name);
  client::Backoff backoff(impl_->options.retry);
  for (;;) {
    grpc::ClientContext context;
    impl_->Prepare(absl::InfiniteDuration(), &context);
    client::Server& server = impl_->servers->current();
    const auto stream = server.service().WatchOperation(&context, request);
    google::longrunning::Operation message;
    while (stream->Read(&message)) {
      backoff.Reset();
      const Operation operation = client::FromProto(message);
      const bool go_on = !update || update(operation);
      if (!operation.done && go_on) continue;
      context.TryCancel();
      stream->Finish();  // says cancelled, which is known
      if (operation.done) return operation;
      return absl::CancelledError("stopped watching");
    }
    absl::Status status = client::FromGrpc(stream->Finish());
    if (status.ok()) status = absl::UnavailableError("the server stopped reporting " + name);
    if (!backoff.ShouldRetry(status)) return status;
    impl_->servers->Leave(server);
    absl::SleepFor(backoff.NextWait());
  }
}

absl::StatusOr<Operation> Client::WaitOperation(const std::string& name) {
  return WatchOperation(name, nullptr);
}

}  // namespace liquidblend
