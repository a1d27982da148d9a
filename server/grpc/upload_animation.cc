#include <grpcpp/impl/codegen/proto_utils.h>

#include <memory>
#include <utility>

#include "absl/time/time.h"
#include "server/api/api_messages.h"
#include "server/api/upload.h"
#include "server/base/errors.h"
#include "server/base/guarded.h"
#include "server/base/names.h"
#include "server/grpc/call.h"
#include "server/grpc/streaming.h"

namespace liquidblend::server {
namespace {

using google::longrunning::Operation;
using UploadReactor = grpc::ServerReadReactor<grpc::ByteBuffer>;

// When a client is lost, the end of its messages may be seen a moment before the cancellation. What
// an older client, which does not say how many files it sends, has sent by then must not be taken
// for the whole.
constexpr absl::Duration kGoneClientDelay = absl::Milliseconds(50);

// Size limit of a message without a chunk: 20,000 times of frames take 160,000 bytes.
constexpr int64_t kMaxHeaderBytes = int64_t{256} << 10;

class UploadCall final : public Call<UploadReactor> {
 public:
  UploadCall(Backends& backends, std::shared_ptr<Admission> admission,
             grpc::CallbackServerContext* context, grpc::ByteBuffer* response)
      : Call(std::move(admission)),
        backends_(backends),
        context_(context),
        response_(response),
        upload_(std::make_shared<Upload>(
            UploadStores{backends.catalog, backends.blobs, backends.uploads},
            LimitsOf(backends.limits, caller().principal), caller())) {}

  // Deleting the files of an upload that broke off waits for the store.
  ~UploadCall() override {
    RunGuarded("the end of an upload", [this] {
      backends_.transfers.PostMore([upload = std::move(upload_)]() mutable { upload = nullptr; });
    });
  }

  void OnReadDone(bool ok) override {
    Attempt([this, ok] { Go(ok); });
  }

 private:
  void Begin() override { ReadNext(); }

  void Go(bool ok) {
    const auto self = shared_from_this();
    const bool is_accepted =
        ok ? backends_.transfers.PostMore([this, self] { Attempt([this] { AddMessage(); }); })
           : backends_.transfers.PostAfter(
                 upload_->knows_num_files() ? absl::ZeroDuration() : kGoneClientDelay,
                 [this, self] { Attempt([this] { Submit(); }); });
    if (!is_accepted) Close(ShuttingDown());
  }

  void ReadNext() {
    Read([this] { StartRead(&bytes_); });
  }

  void AddMessage() {
    if (has_ended()) return;
    const absl::Status status = Add();
    if (!status.ok()) return Close(status);
    ReadNext();
  }

  // The message is gone afterwards: a parsed one may take 30 times its size, and the next may never
  // come.
  absl::Status Add() {
    const auto size_bytes = static_cast<int64_t>(bytes_.Length());
    v1::UploadAnimationRequest message;
    const bool is_parsed =
        grpc::SerializationTraits<v1::UploadAnimationRequest>::Deserialize(&bytes_, &message).ok();
    bytes_.Clear();
    if (!is_parsed) return MalformedRequest("UploadAnimation");
    if (!message.has_chunk() && size_bytes > kMaxHeaderBytes) {
      return RequestTooLarge("UploadAnimation", size_bytes, kMaxHeaderBytes);
    }
    if (message.has_header()) set_resource(AnimationName(message.header().animation_id()));
    return upload_->Add(message);
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
};

}  // namespace

UploadReactor* UploadAnimation(Backends& backends, std::shared_ptr<Admission> admission,
                               grpc::CallbackServerContext* context, grpc::ByteBuffer* response) {
  return Call<UploadReactor>::Start<UploadCall>(backends, std::move(admission), context, response);
}

}  // namespace liquidblend::server
