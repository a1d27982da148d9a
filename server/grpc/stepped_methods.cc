// The methods that take several steps: ImportAnimation and MeasureCorrespondences.
#include <memory>
#include <utility>

#include "server/api/handlers.h"
#include "server/api/import_animation.h"
#include "server/grpc/stepped_call.h"
#include "server/grpc/streaming.h"

namespace liquidblend::server {

grpc::ServerUnaryReactor* ImportAnimation(Backends& backends, std::shared_ptr<Admission> admission,
                                          const ImportRoots& roots,
                                          v1::ImportAnimationRequest request,
                                          grpc::ByteBuffer* response) {
  return StartSteppedCall(backends, std::move(admission), response,
                          [&backends, &roots, request = std::move(request)](
                              const Caller& caller, auto is_wanted, auto done) mutable {
                            ImportAnimation(backends, roots, std::move(request), caller,
                                            std::move(is_wanted), std::move(done));
                          });
}

grpc::ServerUnaryReactor* MeasureCorrespondences(Backends& backends,
                                                 std::shared_ptr<Admission> admission,
                                                 v1::MeasureCorrespondencesRequest request,
                                                 grpc::ByteBuffer* response) {
  return StartSteppedCall(
      backends, std::move(admission), response,
      [&backends, request = std::move(request)](const Caller& caller, auto is_wanted, auto done) {
        MeasureCorrespondences(backends, request, caller, std::move(is_wanted), std::move(done));
      });
}

}  // namespace liquidblend::server
