// Operations as seen by clients of this server.
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "google/longrunning/operations.pb.h"
#include "liquidblend/store/v1/records.pb.h"
#include "server/api/api_messages.h"
#include "server/base/operation_looks.h"
#include "server/frames/backends.h"

namespace liquidblend::server {

// ToOperation() of a job. A registration is shown as running, in the stage "loading", while this
// server's memory has an older version of its family than it has published. So a client that has
// seen it done gets at least that version.
// Errors: ToOperation()'s.  Threads: safe; does not wait for the load.
absl::StatusOr<google::longrunning::Operation> ToServedOperation(Backends& backends,
                                                                 const store::v1::JobRecord& job,
                                                                 WorkerList& workers);
absl::StatusOr<google::longrunning::Operation> ToServedOperation(Backends& backends,
                                                                 const store::v1::JobRecord& job);

// The look at an operation that all its watchers share.  Threads: safe.
std::shared_ptr<OperationLook> WatchedOperation(Backends& backends, const std::string& name);

}  // namespace liquidblend::server
