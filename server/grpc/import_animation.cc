#include "server/api/import_animation.h"

#include <memory>
#include <utility>

#include "server/base/guarded.h"
#include "server/grpc/byte_buffers.h"
#include "server/grpc/call.h"
#include "server/grpc/streaming.h"

namespace liquidblend::server {
namespace {

using google::longrunning::Operation;
using ImportReactor = grpc::ServerUnaryReactor;

// A client that goes away ends the import.
class ImportCall final : public Call<ImportReactor> {
 public:
  ImportCall(Backends& backends, std::shared_ptr<Admission> admission, const ImportRoots& roots,
             v1::ImportAnimationRequest request, grpc::ByteBuffer* response)
      : Call(std::move(admission)),
        backends_(backends),
        roots_(roots),
        request_(std::move(request)),
        response_(response) {}

 private:
  void Begin() override {
    const auto self = shared_from_this();
    ImportAnimation(
        backends_, roots_, std::move(request_), caller(), [this, self] { return !has_ended(); },
        [this, self](const absl::StatusOr<Operation>& operation) {
          if (!operation.ok()) return Close(operation.status());
          Attempt([&] { AnswerWith(*operation); });
        });
  }

  void AnswerWith(const Operation& operation) {
    grpc::ByteBuffer bytes = ToByteBuffer(operation.SerializeAsString());
    Answer([&] { response_->Swap(&bytes); });
  }

  Backends& backends_;
  const ImportRoots& roots_;
  v1::ImportAnimationRequest request_;
  grpc::ByteBuffer* const response_;
};

}  // namespace

ImportReactor* ImportAnimation(Backends& backends, std::shared_ptr<Admission> admission,
                               const ImportRoots& roots, v1::ImportAnimationRequest request,
                               grpc::ByteBuffer* response) {
  return Call<ImportReactor>::Start<ImportCall>(backends, std::move(admission), roots,
                                                std::move(request), response);
}

}  // namespace liquidblend::server
