#include "worker/jobs/run_import.h"

#include <memory>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "worker/ingest/find_up.h"
#include "worker/ingest/read_animation.h"
#include "worker/jobs/attempt/publish.h"
#include "worker/jobs/job_options.h"
#include "worker/jobs/stored_file.h"

namespace liquidblend::jobs {
namespace {

struct OpenFiles {
  std::vector<std::shared_ptr<const store::Blob>> blobs;
  std::vector<ingest::InputFile> files;  // views on `blobs`
};

absl::StatusOr<OpenFiles> OpenBlobs(const store::v1::ImportJob& job, store::BlobStore& blobs) {
  OpenFiles open;
  for (const store::v1::SourceFile& file : job.files()) {
    absl::StatusOr<std::shared_ptr<const store::Blob>> blob = blobs.Open(file.blob());
    if (!blob.ok()) {
      return absl::Status(blob.status().code(),
                          absl::StrCat("file '", file.name(), "': ", blob.status().message()));
    }
    open.files.push_back({file.name(), (*blob)->bytes()});
    open.blobs.push_back(*std::move(blob));
  }
  return open;
}

// Errors: kDataLoss if a page of a file could not be read since it was opened.
absl::Status CheckReadable(const OpenFiles& open) {
  for (size_t k = 0; k < open.blobs.size(); ++k) {
    const absl::Status readable = open.blobs[k]->Check();
    if (readable.ok()) continue;
    return absl::Status(readable.code(),
                        absl::StrCat("file '", open.files[k].name, "': ", readable.message()));
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status RunImport(const store::v1::ImportJob& job, JobContext& context) {
  LB_RETURN_IF_ERROR(context.BeginStage("opening files", 0.0, 0.1));
  LB_ASSIGN_OR_RETURN(const OpenFiles input, OpenBlobs(job, context.blobs));
  LB_RETURN_IF_ERROR(context.BeginStage("reading frames", 0.1, 0.85));
  absl::StatusOr<mesh::Animation> animation =
      ingest::ReadAnimation(job.animation(), input.files, ToImportOptions(job.options()),
                            context.arena, context.StageProgress());
  LB_RETURN_IF_ERROR(CheckReadable(input));  // first: what cannot be read looks like bad input
  LB_RETURN_IF_ERROR(animation.status());
  ingest::SettleUp(*animation, context.arena);
  LB_RETURN_IF_ERROR(context.BeginStage("publishing", 0.85, 1.0));
  LB_ASSIGN_OR_RETURN(const store::v1::AnimationRecord record,
                      StoreAnimation(*animation, context.blobs));
  return PublishWhileLeased(context.keeper, [&] {
    return context.catalog.PublishAnimation(context.keeper.lease_id(), record);
  });
}

}  // namespace liquidblend::jobs
