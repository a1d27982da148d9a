#include "server/api/served_operation.h"

#include "core/base/status_macros.h"
#include "liquidblend/v1/liquidblend.pb.h"
#include "server/api/api_messages.h"
#include "server/api/handlers.h"
#include "server/frames/find_family.h"

namespace liquidblend::server {
namespace {

using google::longrunning::Operation;

Operation StillLoading(Operation operation) {
  operation.set_done(false);
  operation.clear_response();
  v1::RegisterFamilyMetadata metadata;
  if (operation.metadata().UnpackTo(&metadata)) {
    metadata.mutable_progress()->set_stage("loading");
    operation.mutable_metadata()->PackFrom(metadata);
  }
  return operation;
}

}  // namespace

absl::StatusOr<Operation> ToServedOperation(Backends& backends, const store::v1::JobRecord& job) {
  WorkerList workers(backends.catalog);
  return ToServedOperation(backends, job, workers);
}

absl::StatusOr<Operation> ToServedOperation(Backends& backends, const store::v1::JobRecord& job,
                                            WorkerList& workers) {
  LB_ASSIGN_OR_RETURN(Operation operation, ToOperation(job, backends.catalog, workers));
  const std::string& family = job.register_family().family();
  const bool has_published = operation.has_response() && job.published_version() > 0;
  if (!has_published || !IsBehind(backends, family, job.published_version())) return operation;
  return StillLoading(std::move(operation));
}

std::shared_ptr<OperationLook> WatchedOperation(Backends& backends, const std::string& name) {
  return backends.operation_looks.Of(name, [&backends, name] {
    google::longrunning::GetOperationRequest request;
    request.set_name(name);
    return GetOperation(backends, request);
  });
}

}  // namespace liquidblend::server
