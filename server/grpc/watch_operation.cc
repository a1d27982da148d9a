#include <algorithm>
#include <memory>
#include <string>
#include <utility>

#include "absl/time/clock.h"
#include "server/api/served_operation.h"
#include "server/base/errors.h"
#include "server/base/operation_looks.h"
#include "server/grpc/byte_buffers.h"
#include "server/grpc/call.h"
#include "server/grpc/streaming.h"

namespace liquidblend::server {
namespace {

using google::longrunning::WaitOperationRequest;
using WriteReactor = grpc::ServerWriteReactor<grpc::ByteBuffer>;

// A call that looks at an operation again and again. Its timers are on `steps`, so only looks take
// a thread that waits for the catalog.
template <typename Reactor>
class LookingCall : public Call<Reactor> {
 public:
  LookingCall(Backends& backends, std::shared_ptr<Admission> admission, const std::string& name)
      : Call<Reactor>(std::move(admission)),
        backends_(backends),
        look_(WatchedOperation(backends, name)) {}

 protected:
  virtual void Show(const SeenOperationPtr& seen) = 0;

  // Goes on with Show() after that time, unless the call ends.
  void LookAfter(absl::Duration delay) {
    const auto self = this->shared_from_this();
    const bool is_posted =
        backends_.steps.PostAfter(delay, [this, self] { this->Attempt([this] { Look(); }); });
    if (!is_posted) this->Close(ShuttingDown());
  }

  absl::Duration interval() const { return backends_.operation_looks.Interval(); }

 private:
  void Begin() override { LookAfter(absl::ZeroDuration()); }

  void Look() {
    if (this->has_ended()) return;
    look_->Ask(
        [this, self = this->shared_from_this()](const absl::StatusOr<SeenOperationPtr>& seen) {
          if (!seen.ok()) return this->Close(seen.status());
          this->Attempt([&] {
            if (!this->has_ended()) Show(*seen);
          });
        });
  }

  Backends& backends_;
  const std::shared_ptr<OperationLook> look_;
};

class WatchCall final : public LookingCall<WriteReactor> {
 public:
  using LookingCall::LookingCall;

  void OnWriteDone(bool ok) override {
    if (!EndWrite(ok)) return;
    if (shown_->operation.done()) return Close(absl::OkStatus());
    Attempt([this] { LookAfter(interval()); });
  }

 private:
  void Show(const SeenOperationPtr& seen) override {
    if (shown_ != nullptr && seen->bytes == shown_->bytes) return LookAfter(interval());
    shown_ = seen;
    bytes_ = ToByteBuffer(seen->bytes);
    Write([this] { StartWrite(&bytes_); });
  }

  SeenOperationPtr shown_;  // written last
  grpc::ByteBuffer bytes_;  // of it
};

class WaitCall final : public LookingCall<grpc::ServerUnaryReactor> {
 public:
  WaitCall(Backends& backends, std::shared_ptr<Admission> admission, const std::string& name,
           absl::Time deadline, grpc::ByteBuffer* response)
      : LookingCall(backends, std::move(admission), name),
        deadline_(deadline),
        response_(response) {}

 private:
  void Show(const SeenOperationPtr& seen) override {
    const absl::Duration left = deadline_ - absl::Now();
    if (!seen->operation.done() && left > absl::ZeroDuration()) {
      return LookAfter(std::min(left, interval()));
    }
    Answer([&] { *response_ = ToByteBuffer(seen->bytes); });
  }

  const absl::Time deadline_;
  grpc::ByteBuffer* const response_;
};

absl::Time DeadlineOf(const WaitOperationRequest& request) {
  if (!request.has_timeout()) return absl::InfiniteFuture();
  return absl::Now() + absl::Seconds(request.timeout().seconds()) +
         absl::Nanoseconds(request.timeout().nanos());
}

}  // namespace

WriteReactor* WatchOperation(Backends& backends, std::shared_ptr<Admission> admission,
                             const v1::WatchOperationRequest& request) {
  return Call<WriteReactor>::Start<WatchCall>(backends, std::move(admission), request.name());
}

grpc::ServerUnaryReactor* WaitOperation(Backends& backends, std::shared_ptr<Admission> admission,
                                        const WaitOperationRequest& request,
                                        grpc::ByteBuffer* response) {
  return Call<grpc::ServerUnaryReactor>::Start<WaitCall>(
      backends, std::move(admission), request.name(), DeadlineOf(request), response);
}

}  // namespace liquidblend::server
