#include <memory>
#include <string>
#include <utility>

#include "server/api/operation_watch.h"
#include "server/grpc/call.h"
#include "server/grpc/streaming.h"

namespace liquidblend::server {
namespace {

using WriteReactor = grpc::ServerWriteReactor<grpc::ByteBuffer>;

// A call about an operation that it looks at again and again.
template <typename Reactor>
class LookingCall : public Call<Reactor> {
 public:
  LookingCall(Backends& backends, std::shared_ptr<Admission> admission, std::string name)
      : Call<Reactor>(std::move(admission)), backends_(backends), name_(std::move(name)) {}

 protected:
  virtual void Look() = 0;  // asks the watch, with Shower()
  virtual void Show(const SeenOperationPtr& seen) = 0;

  OperationWatch& watch() { return *watch_; }

  // The operation's bytes; all who wait for them share them.
  absl::StatusOr<grpc::ByteBuffer> BytesOf(const SeenOperationPtr& seen) {
    return this->Hold(backends_, AnswerPtr(seen, &seen->bytes));
  }

  // Goes on with Show(), unless the call ends.
  OperationWatch::Done Shower() {
    return [this, self = this->shared_from_this()](const absl::StatusOr<SeenOperationPtr>& seen) {
      if (!seen.ok()) return this->Close(seen.status());
      this->Attempt([&] {
        if (!this->has_ended()) Show(*seen);
      });
    };
  }

 private:
  void Begin() override {
    watch_ =
        std::make_shared<OperationWatch>(backends_, name_, [this, weak = this->weak_from_this()] {
          const auto self = weak.lock();
          return self != nullptr && !this->has_ended();
        });
    Look();
  }

  Backends& backends_;
  const std::string name_;
  std::shared_ptr<OperationWatch> watch_;
};

class WatchCall final : public LookingCall<WriteReactor> {
 public:
  using LookingCall::LookingCall;

  void OnWriteDone(bool ok) override {
    bytes_.Clear();  // lets the operation go; the next change may be far away
    if (!EndWrite(ok)) return;
    if (is_done_) return Close(absl::OkStatus());
    Attempt([this] { Look(); });
  }

 private:
  void Look() override { watch().Next(Shower()); }

  void Show(const SeenOperationPtr& seen) override {
    is_done_ = seen->operation.done();
    auto bytes = BytesOf(seen);
    if (!bytes.ok()) return Close(bytes.status());
    bytes_.Swap(&*bytes);
    Write([this] { StartWrite(&bytes_); });
  }

  bool is_done_ = false;    // what was written last
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
  void Look() override { watch().AwaitDone(deadline_, Shower()); }

  void Show(const SeenOperationPtr& seen) override {
    auto bytes = BytesOf(seen);
    if (!bytes.ok()) return Close(bytes.status());
    Answer([&] { response_->Swap(&*bytes); });
  }

  const absl::Time deadline_;
  grpc::ByteBuffer* const response_;
};

}  // namespace

WriteReactor* WatchOperation(Backends& backends, std::shared_ptr<Admission> admission,
                             const v1::WatchOperationRequest& request) {
  return Call<WriteReactor>::Start<WatchCall>(backends, std::move(admission), request.name());
}

grpc::ServerUnaryReactor* WaitOperation(Backends& backends, std::shared_ptr<Admission> admission,
                                        const google::longrunning::WaitOperationRequest& request,
                                        grpc::ByteBuffer* response) {
  return Call<grpc::ServerUnaryReactor>::Start<WaitCall>(
      backends, std::move(admission), request.name(), DeadlineOf(request), response);
}

}  // namespace liquidblend::server
