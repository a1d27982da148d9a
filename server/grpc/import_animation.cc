#include <memory>
#include <optional>
#include <utility>

#include "core/base/status_macros.h"
#include "server/api/api_messages.h"
#include "server/api/import_source.h"
#include "server/api/upload.h"
#include "server/base/errors.h"
#include "server/base/guarded.h"
#include "server/grpc/byte_buffers.h"
#include "server/grpc/call.h"
#include "server/grpc/streaming.h"

namespace liquidblend::server {
namespace {

using google::longrunning::Operation;
using ImportReactor = grpc::ServerUnaryReactor;

// One chunk at a time goes from file to blob, so that others get their turns on the pool, and a
// client that goes away ends it.
class ImportCall final : public Call<ImportReactor> {
 public:
  ImportCall(Backends& backends, std::shared_ptr<Admission> admission, const ImportRoots& roots,
             v1::ImportAnimationRequest request, grpc::ByteBuffer* response)
      : Call(std::move(admission)),
        backends_(backends),
        roots_(roots),
        request_(std::move(request)),
        response_(response),
        limits_(LimitsOf(backends.limits, caller().principal)),
        upload_(std::make_shared<Upload>(
            UploadStores{backends.catalog, backends.blobs, backends.uploads}, limits_,
            caller().principal, /*header_field=*/"")) {}

  // Deleting the files of an import that broke off waits for the store.
  ~ImportCall() override {
    RunGuarded("the end of an upload", [this] {
      backends_.transfers.PostMore([upload = std::move(upload_)]() mutable { upload = nullptr; });
    });
  }

 private:
  void Begin() override { PostStep(); }

  void PostStep() {
    const auto self = shared_from_this();
    if (!backends_.transfers.PostMore([this, self] { Attempt([this] { Step(); }); }))
      Close(ShuttingDown());
  }

  void Step() {
    if (has_ended()) return;
    const absl::StatusOr<bool> has_more = Guarded([this] { return Copy(); });
    if (!has_more.ok()) return Close(has_more.status());
    if (*has_more) return PostStep();
    const auto bytes = Guarded([this]() -> absl::StatusOr<grpc::ByteBuffer> {
      LB_ASSIGN_OR_RETURN(const store::pb::JobRecord job, upload_->Submit());
      LB_ASSIGN_OR_RETURN(const Operation operation, ToOperation(job, backends_.catalog));
      return ToByteBuffer(operation.SerializeAsString());
    });
    if (!bytes.ok()) return Close(bytes.status());
    Answer([&] { *response_ = *bytes; });
  }

  // The header first, then message by message what the source has; false: nothing more.
  absl::StatusOr<bool> Copy() {
    v1::UploadAnimationRequest message;
    if (source_.has_value()) {
      LB_ASSIGN_OR_RETURN(const bool has_more, source_->Next(message));
      if (!has_more) return false;
      const absl::Status added = upload_->Add(message);
      // A wrong file is a violation of the location.
      if (absl::IsInvalidArgument(added)) return AtField("location", added);
      LB_RETURN_IF_ERROR(added);
      return true;
    }
    message.mutable_header()->set_animation_id(request_.animation_id());
    *message.mutable_header()->mutable_options() = request_.options();
    message.mutable_header()->set_request_id(request_.request_id());
    message.mutable_header()->set_priority(request_.priority());
    LB_RETURN_IF_ERROR(upload_->Add(message));
    absl::StatusOr<ImportSource> source = ImportSource::Open(
        roots_, request_.location(), limits_.max_upload_files, request_.options().pattern());
    LB_RETURN_IF_ERROR(source.status());
    source_.emplace(*std::move(source));
    return true;
  }

  Backends& backends_;
  const ImportRoots& roots_;
  const v1::ImportAnimationRequest request_;
  grpc::ByteBuffer* const response_;
  const Limits limits_;
  std::shared_ptr<Upload> upload_;
  std::optional<ImportSource> source_;
};

}  // namespace

ImportReactor* ImportAnimation(Backends& backends, std::shared_ptr<Admission> admission,
                               const ImportRoots& roots, v1::ImportAnimationRequest request,
                               grpc::ByteBuffer* response) {
  return Call<ImportReactor>::Start<ImportCall>(backends, std::move(admission), roots,
                                                std::move(request), response);
}

}  // namespace liquidblend::server
