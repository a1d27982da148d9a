// UploadAnimation of a tar archive, without a wire.
#pragma once

#include <memory>
#include <string>

#include "absl/functional/any_invocable.h"
#include "absl/status/statusor.h"
#include "google/longrunning/operations.pb.h"
#include "liquidblend/v1/liquidblend.pb.h"
#include "server/access/principal.h"
#include "server/frames/backends.h"

namespace liquidblend::server {

// An upload whose files are those of an archive that arrives in pieces. One that is not submitted
// leaves nothing visible.  Threads: one call at a time, until its `done` has been called.
class ArchiveUpload {
 public:
  virtual ~ArchiveUpload() = default;

  // Takes the next piece, then calls `done`, on a thread of a pool or before this returns.
  // Errors: Upload::Add()'s; kInvalidArgument, ARCHIVE_MALFORMED, for TarSplitter's.
  virtual void Add(std::string piece, absl::AnyInvocable<void(absl::Status)> done) = 0;

  // To be called after the last piece. Errors: Upload::Submit()'s; as above, if it ends early.
  virtual void Submit(
      absl::AnyInvocable<void(absl::StatusOr<google::longrunning::Operation>)> done) = 0;
};

// Chunk by chunk on the pool `transfers`.
//   header  the first message of an upload; its errors are those of the first piece
// The backends outlive it.
std::shared_ptr<ArchiveUpload> OpenArchiveUpload(Backends& backends,
                                                 v1::UploadAnimationRequest header,
                                                 const Caller& caller);

}  // namespace liquidblend::server
