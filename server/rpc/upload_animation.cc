#include <grpcpp/impl/codegen/proto_utils.h>

#include <memory>
#include <utility>

#include "absl/time/time.h"
#include "server/rpc/api_messages.h"
#include "server/rpc/call.h"
#include "server/rpc/errors.h"
#include "server/rpc/guarded.h"
#include "server/rpc/names.h"
#include "server/rpc/streaming.h"
#include "server/rpc/upload.h"

namespace liquidblend::rpc {
namespace {

using google::longrunning::Operation;
using Reactor = grpc::ServerReadReactor<grpc::ByteBuffer>;

// When a client is lost, the end of its messages may be seen a moment before the cancellation. What
// an older client, which does not say how many files it sends, has sent by then must not be taken
// for the whole.
constexpr absl::Duration kGoneClientDelay = absl::Milliseconds(50);

class UploadCall final : public Call<Reactor> {
 public:
  UploadCall(Backends& backends, std::shared_ptr<Admission> admission,
             grpc::CallbackServerContext* context, grpc::ByteBuffer* response)
      : Call(std::move(admission)),
        backends_(backends),
        context_(context),
        response_(response),
        upload_(std::make_shared<Upload>(
            UploadStores{backends.catalog, backends.blobs, backends.uploads},
            LimitsOf(backends.limits, caller().principal), caller().principal)) {}

  // Deleting the files of an upload that broke off waits for the store.
  ~UploadCall() override {
    backends_.io.PostMore([upload = std::move(upload_)]() mutable { upload = nullptr; });
  }

  void OnReadDone(bool ok) override {
    const auto self = shared_from_this();
    const bool is_accepted =
        ok ? backends_.io.PostMore([this, self] { AddMessage(); })
           : backends_.io.PostAfter(
                 upload_->knows_num_files() ? absl::ZeroDuration() : kGoneClientDelay,
                 [this, self] { Submit(); });
    if (!is_accepted) Close(ShuttingDown());
  }

 private:
  void Begin() override { ReadNext(); }

  void ReadNext() {
    Read([this] { StartRead(&bytes_); });
  }

  void AddMessage() {
    if (has_ended()) return;
    if (!grpc::SerializationTraits<v1::UploadAnimationRequest>::Deserialize(&bytes_, &message_)
             .ok()) {
      return Close(MalformedRequest("UploadAnimation"));
    }
    if (message_.has_header()) set_resource(AnimationName(message_.header().animation_id()));
    const absl::Status status = Guarded([&] { return upload_->Add(message_); });
    if (!status.ok()) return Close(status);
    ReadNext();
  }

  void Submit() {
    if (is_abandoned(*context_)) return Close(absl::CancelledError("the client has gone"));
    absl::StatusOr<Operation> operation = Guarded([&]() -> absl::StatusOr<Operation> {
      absl::StatusOr<store::pb::JobRecord> job = upload_->Submit();
      if (!job.ok()) return job.status();
      return ToOperation(*job, backends_.catalog);
    });
    if (!operation.ok()) return Close(operation.status());
    Answer([&] {
      bool owns_bytes = false;
      grpc::SerializationTraits<Operation>::Serialize(*operation, response_, &owns_bytes);
    });
  }

  Backends& backends_;
  grpc::CallbackServerContext* const context_;
  grpc::ByteBuffer* const response_;
  std::shared_ptr<Upload> upload_;
  grpc::ByteBuffer bytes_;  // the read under way
  v1::UploadAnimationRequest message_;
};

}  // namespace

Reactor* UploadAnimation(Backends& backends, std::shared_ptr<Admission> admission,
                         grpc::CallbackServerContext* context, grpc::ByteBuffer* response) {
  return Call<Reactor>::Start<UploadCall>(backends, std::move(admission), context, response);
}

}  // namespace liquidblend::rpc
