#include <string>
#include <utility>

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
  response.set_next_page_token(found->next_page_token);
  WorkerList workers(backends.catalog);
  size_t num_bytes = 0;
  for (size_t k = 0; k < found->records.size(); ++k) {
    LB_ASSIGN_OR_RETURN(lro::Operation operation,
                        ToServedOperation(backends, found->records[k], workers));
    // One that is done has a family in it, whose record may be much longer than the job's.
    num_bytes += operation.ByteSizeLong();
    if (k > 0 && num_bytes > kMaxOperationsBytes) {
      response.set_next_page_token(found->tokens[k - 1]);
      break;
    }
    *response.add_operations() = std::move(operation);
  }
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
