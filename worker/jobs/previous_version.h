// The version of a family that a refinement starts from.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/mesh/correspondence.h"
#include "core/mesh/registered_family.h"
#include "core/mesh/space_time_mesh.h"
#include "core/store/blobs/blob_store.h"
#include "liquidblend/store/v1/records.pb.h"
#include "worker/jobs/assemble_family.h"
#include "worker/jobs/job_context.h"

namespace liquidblend::jobs {

// A copy of the family with times in frames, as registrations need them, without its levels.
mesh::RegisteredFamily InFrames(const mesh::RegisteredFamily& family);

struct PreviousVersion {
  // Times are in frames, whatever the family's own axis; none if the job is not a refinement.
  std::optional<mesh::RegisteredFamily> family;
  std::shared_ptr<const store::Blob> file;  // of the family

  const mesh::RegisteredFamily* get() const { return family ? &*family : nullptr; }
  // Errors: kDataLoss if a part of the file could not be read since it was opened. Then results
  // that were computed from the family are wrong, and errors that were found in it may be.
  absl::Status CheckFile() const;
};

// Opens the version job.refine_version(); 0: none.
// Errors: kFailedPrecondition if the family is at another version by now; kInvalidArgument if it
// does not have the job's source and targets; those of catalog and store.
absl::StatusOr<PreviousVersion> OpenPreviousVersion(const store::v1::RegisterJob& job,
                                                    JobContext& context);

// Errors: kInvalidArgument if the family's vertices differ from those of `source` by more than a
// tenth of an edge.
absl::Status CheckSameVertices(const mesh::RegisteredFamily& family,
                               const mesh::SpaceTimeMesh& source);

std::vector<mesh::Correspondence> CorrespondencesOf(const mesh::FamilyTarget& target);

// Whether the refinement leaves a target unchanged: others have new correspondences and this one
// has none. If no target has any, all are refined.
bool IsKept(const store::v1::RegisterJob& job, int target_index,
            const mesh::RegisteredFamily& previous);

// The target as it is in the family. Requires: IsKept().
RegisteredTarget KeptTarget(const mesh::RegisteredFamily& previous, int target_index);

}  // namespace liquidblend::jobs
