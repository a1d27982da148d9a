// ImportAnimation without a wire.
#pragma once

#include "absl/functional/any_invocable.h"
#include "absl/status/statusor.h"
#include "google/longrunning/operations.pb.h"
#include "liquidblend/v1/liquidblend.pb.h"
#include "server/access/principal.h"
#include "server/api/import_source.h"
#include "server/api/operation_watch.h"
#include "server/frames/backends.h"

namespace liquidblend::server {

// Copies the files at the location into blobs, chunk by chunk on the pool `transfers`, so that
// others get their turns there; then submits the job. An import that fails leaves nothing visible.
//   roots      outlive the import
//   is_wanted  asked before each step; once it says no, the import ends with kCancelled
//   done       called once, on a thread of the pool, or before this returns
// Errors: those of ImportSource and Upload.
void ImportAnimation(Backends& backends, const ImportRoots& roots,
                     v1::ImportAnimationRequest request, const Caller& caller, IsWanted is_wanted,
                     absl::AnyInvocable<void(absl::StatusOr<google::longrunning::Operation>)> done);

}  // namespace liquidblend::server
