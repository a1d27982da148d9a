#include <memory>
#include <utility>

#include "absl/time/time.h"
#include "server/rpc/api_messages.h"
#include "server/rpc/guarded.h"
#include "server/rpc/streaming.h"
#include "server/rpc/upload.h"

namespace liquidblend::rpc {
namespace {

using google::longrunning::Operation;
using Reactor = grpc::ServerReadReactor<v1::UploadAnimationRequest>;

// When a client is lost, the end of its messages may be told a moment before the cancellation. What
// it has sent so far must not be taken for the whole.
constexpr absl::Duration kGoneClientDelay = absl::Milliseconds(50);

class UploadCall final : public Call<Reactor> {
 public:
  UploadCall(Backends& backends, OpenCalls& calls, grpc::CallbackServerContext* context,
             Operation* response)
      : Call(calls),
        backends_(backends),
        context_(context),
        response_(response),
        upload_(backends.catalog, backends.blobs, backends.limits) {}

  void OnReadDone(bool ok) override {
    const auto self = shared_from_this();
    const bool is_accepted =
        ok ? backends_.io.PostMore([this, self] { AddMessage(); })
           : backends_.io.PostAfter(kGoneClientDelay, [this, self] { Submit(); });
    if (!is_accepted) Close(absl::UnavailableError("the server is shutting down"));
  }

 private:
  void Begin() override { ReadNext(); }

  void ReadNext() {
    Read([this] { StartRead(&message_); });
  }

  void AddMessage() {
    if (has_ended()) return;
    const absl::Status status = Guarded([&] { return upload_.Add(message_); });
    if (!status.ok()) return Close(status);
    ReadNext();
  }

  void Submit() {
    if (has_ended()) return;
    if (context_->IsCancelled()) return Close(absl::CancelledError("the client has gone"));
    absl::StatusOr<Operation> operation = Guarded([&]() -> absl::StatusOr<Operation> {
      absl::StatusOr<store::pb::JobRecord> job = upload_.Submit();
      if (!job.ok()) return job.status();
      return ToOperation(*job, backends_.catalog);
    });
    if (operation.ok()) *response_ = *std::move(operation);
    Close(operation.status());
  }

  Backends& backends_;
  grpc::CallbackServerContext* const context_;
  Operation* const response_;
  Upload upload_;
  v1::UploadAnimationRequest message_;
};

}  // namespace

Reactor* UploadAnimation(Backends& backends, OpenCalls& calls, grpc::CallbackServerContext* context,
                         Operation* response) {
  return Call<Reactor>::Start<UploadCall>(backends, calls, context, response);
}

}  // namespace liquidblend::rpc
