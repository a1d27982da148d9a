#include <string>

#include "core/base/status_macros.h"
#include "core/store/blobs/upload_files.h"
#include "server/api/handlers.h"
#include "server/api/served_operation.h"
#include "server/base/errors.h"
#include "server/base/names.h"
#include "server/base/paging.h"

namespace liquidblend::server {
namespace {

// No worker sees an import again that is cancelled in the queue. One that a worker has is left to
// that worker. Nobody waits for the store: what stays there is collected.
void DeleteFilesIfCancelled(Backends& backends, const std::string& id) {
  const absl::StatusOr<store::pb::JobRecord> job = backends.catalog.GetJob(id);
  if (!job.ok() || job->state() != store::pb::JobRecord::CANCELLED) return;
  if (job->import_animation().files().empty()) return;
  backends.transfers.PostMore([&backends, import = job->import_animation()] {
    store::DeleteUploadedFiles(import, backends.blobs);
  });
}

}  // namespace

absl::StatusOr<lro::Operation> GetOperation(Backends& backends,
                                            const lro::GetOperationRequest& request) {
  LB_ASSIGN_OR_RETURN(const std::string id, OperationId("name", request.name()));
  LB_ASSIGN_OR_RETURN(const store::pb::JobRecord job, backends.catalog.GetJob(id));
  return ToServedOperation(backends, job);
}

absl::StatusOr<lro::ListOperationsResponse> ListOperations(
    Backends& backends, const lro::ListOperationsRequest& request) {
  FieldViolations violations;
  violations.AddIf(!request.name().empty() && request.name() != "operations", "name",
                   "must be empty or 'operations'");
  violations.AddIf(!request.filter().empty(), "filter", "filters are not supported");
  LB_RETURN_IF_ERROR(violations.ToStatus());
  LB_RETURN_IF_ERROR(CheckPageSize(request.page_size()));
  const auto found = backends.catalog.ListJobs(request.page_size(), request.page_token());
  LB_RETURN_IF_ERROR(FromList(found.status()));
  lro::ListOperationsResponse response;
  WorkerList workers(backends.catalog);
  for (const auto& job : found->records) {
    LB_ASSIGN_OR_RETURN(*response.add_operations(), ToServedOperation(backends, job, workers));
  }
  response.set_next_page_token(found->next_page_token);
  return response;
}

absl::StatusOr<Empty> CancelOperation(Backends& backends,
                                      const lro::CancelOperationRequest& request) {
  LB_ASSIGN_OR_RETURN(const std::string id, OperationId("name", request.name()));
  LB_RETURN_IF_ERROR(backends.catalog.RequestCancel(id));
  DeleteFilesIfCancelled(backends, id);
  return Empty();
}

absl::StatusOr<Empty> DeleteOperation(Backends& backends,
                                      const lro::DeleteOperationRequest& request) {
  LB_ASSIGN_OR_RETURN(const std::string id, OperationId("name", request.name()));
  LB_RETURN_IF_ERROR(backends.catalog.DeleteJob(id));
  return Empty();
}

}  // namespace liquidblend::server
