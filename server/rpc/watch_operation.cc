#include <algorithm>
#include <memory>
#include <string>
#include <utility>

#include "absl/time/clock.h"
#include "server/rpc/call.h"
#include "server/rpc/errors.h"
#include "server/rpc/guarded.h"
#include "server/rpc/handlers.h"
#include "server/rpc/streaming.h"

namespace liquidblend::rpc {
namespace {

using google::longrunning::Operation;
using google::longrunning::WaitOperationRequest;
using WriteReactor = grpc::ServerWriteReactor<Operation>;

absl::StatusOr<Operation> Look(Backends& backends, const std::string& name) {
  google::longrunning::GetOperationRequest request;
  request.set_name(name);
  return Guarded([&] { return GetOperation(backends, request); });
}

class WatchCall final : public Call<WriteReactor> {
 public:
  WatchCall(Backends& backends, std::shared_ptr<Admission> admission, std::string name)
      : Call(std::move(admission)), backends_(backends), name_(std::move(name)) {}

  void OnWriteDone(bool ok) override {
    if (!EndWrite(ok)) return;
    if (shown_.done()) return Close(absl::OkStatus());
    Attempt([this] { PollAfter(backends_.limits.watch_interval); });
  }

 private:
  void Begin() override { PollAfter(absl::ZeroDuration()); }

  void PollAfter(absl::Duration delay) {
    const auto self = shared_from_this();
    if (!backends_.io.PostAfter(delay, [this, self] { Attempt([this] { Poll(); }); })) {
      Close(ShuttingDown());
    }
  }

  void Poll() {
    if (has_ended()) return;
    absl::StatusOr<Operation> operation = Look(backends_, name_);
    if (!operation.ok()) return Close(operation.status());
    if (operation->SerializeAsString() == shown_.SerializeAsString()) {
      return PollAfter(backends_.limits.watch_interval);
    }
    shown_ = *std::move(operation);
    Write([this] { StartWrite(&shown_); });
  }

  Backends& backends_;
  const std::string name_;
  Operation shown_;  // written last
};

class WaitCall final : public Call<grpc::ServerUnaryReactor> {
 public:
  WaitCall(Backends& backends, std::shared_ptr<Admission> admission, std::string name,
           absl::Time deadline, Operation* response)
      : Call(std::move(admission)),
        backends_(backends),
        name_(std::move(name)),
        deadline_(deadline),
        response_(response) {}

 private:
  void Begin() override { PollAfter(absl::ZeroDuration()); }

  void PollAfter(absl::Duration delay) {
    const auto self = shared_from_this();
    if (!backends_.io.PostAfter(delay, [this, self] { Attempt([this] { Poll(); }); })) {
      Close(ShuttingDown());
    }
  }

  void Poll() {
    if (has_ended()) return;
    absl::StatusOr<Operation> operation = Look(backends_, name_);
    if (!operation.ok()) return Close(operation.status());
    const absl::Duration left = deadline_ - absl::Now();
    if (!operation->done() && left > absl::ZeroDuration()) {
      return PollAfter(std::min(left, backends_.limits.watch_interval));
    }
    Answer([&] { *response_ = *std::move(operation); });
  }

  Backends& backends_;
  const std::string name_;
  const absl::Time deadline_;
  Operation* const response_;
};

absl::Time DeadlineOf(const WaitOperationRequest& request) {
  if (!request.has_timeout()) return absl::InfiniteFuture();
  return absl::Now() + absl::Seconds(request.timeout().seconds()) +
         absl::Nanoseconds(request.timeout().nanos());
}

}  // namespace

WriteReactor* WatchOperation(Backends& backends, std::shared_ptr<Admission> admission,
                             const v1::WatchOperationRequest* request) {
  return Call<WriteReactor>::Start<WatchCall>(backends, std::move(admission), request->name());
}

grpc::ServerUnaryReactor* WaitOperation(Backends& backends, std::shared_ptr<Admission> admission,
                                        const WaitOperationRequest* request, Operation* response) {
  return Call<grpc::ServerUnaryReactor>::Start<WaitCall>(
      backends, std::move(admission), request->name(), DeadlineOf(*request), response);
}

}  // namespace liquidblend::rpc
